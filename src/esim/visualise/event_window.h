#pragma once

#include <cstddef>
#include <vector>

#include "esim/events/event.h"

namespace esim::inline visualise {

/// The latest events of a stream, in order, in bounded memory.
class EventWindow {
 public:
  /// Holds at most `max` events. With `thin`, further events reduce the window to every 2nd, 4th, 8th ... event of the
  /// stream; otherwise they replace the oldest ones.
  explicit EventWindow(std::size_t max, bool thin = false) : max_(max), thin_(thin) {}

  void add(EventSpan events);

  /// Removes the events at or before `t`.
  void forget_until(TimeNs t);

  EventSpan events() const { return EventSpan(events_).subspan(head_); }

  /// Every stride()-th event of the stream is kept.
  std::size_t stride() const { return stride_; }

 private:
  void make_room();

  std::size_t max_;
  bool thin_;
  std::vector<Event> events_;
  std::vector<std::uint64_t> numbers_;  // index of each event in the stream; only with thin_
  std::size_t head_ = 0;                // the events before it are removed
  std::size_t stride_ = 1;
  std::uint64_t seen_ = 0;
};

}  // namespace esim::inline visualise
