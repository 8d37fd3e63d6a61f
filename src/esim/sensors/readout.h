#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/sensors/event_camera_options.h"

namespace esim {

/// The arbiter between the pixels and the outside. Pixels with an event raise a request in their row. One reader serves
/// the rows in the order of their first requests: it takes all of a row's events that have arrived, stamps them with
/// the time at which it does, and is then busy for the row's time plus that of its events. Requests beyond the length
/// of the queue are lost.
class Readout {
 public:
  Readout(const ReadoutOptions& options, int height);

  /// Takes events in their order, none later than `until`, and appends to `out` those that are read out by then, in
  /// order of their new stamps. Every event up to `until` must have been given.
  void advance(EventSpan events, TimeNs until, std::vector<Event>& out);

  std::int64_t dropped() const { return dropped_; }
  std::size_t waiting() const { return waiting_; }

 private:
  void serve_until(TimeNs now, std::vector<Event>& out);

  double ns_per_event_;
  double row_ns_;
  std::size_t capacity_;
  std::vector<std::vector<Event>> rows_;                 // the events that wait, by row
  std::deque<std::uint16_t> requests_;                   // rows with events, in the order of their first
  TimeNs free_at_ = std::numeric_limits<TimeNs>::min();  // when the reader is done, rounded up,
  double ahead_ = 0;                                     // by so many ns
  std::size_t waiting_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace esim
