// Accelerates (13), read_out() and serve_row() in reference.cpp.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/time.h"
#include "esim/event_camera/options.h"
#include "esim/events/event.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The arbiter of the readout. Pixels with an event raise a request in their row. One reader serves the rows in the
/// order of their first requests: it takes all requests of a row that have arrived, and is then busy for the row's time
/// plus that of its events. Requests beyond the length of the queue are lost.
///
/// A pixel must not raise a second request before its first is served (PixelReadout).
class Readout {
 public:
  Readout(const ReadoutOptions& options, int height);

  /// Takes a request. Requests must be in order of time; serve the rows that are due earlier first. False if the queue
  /// is full and the request is lost.
  bool take(const Event& request);

  /// Time at which the next row is served, if no request comes first; the maximum time if none waits.
  TimeNs next_service() const {
    if (queue_length_ == 0) return std::numeric_limits<TimeNs>::max();
    return std::max(free_from(), rows_[queue_[first_in_queue_]].first.t);
  }
  /// Serves the next row. Returns its requests in order, with the times at which they were raised.
  EventSpan serve();

  /// Time at which a single request raised at t is served, if none waits.
  TimeNs service_of_one(TimeNs t) const { return std::max(free_from(), t); }
  /// Makes the reader busy from `start` on with one event of a row.
  void occupy_with_one(TimeNs start) { occupy(start, 1); }

  /// Takes and serves the first requests while no two of a row are served together, and each is served before `end` and
  /// within `delay` after it was raised; none if others already wait. Appends them to `served`, with the times of their
  /// service, and returns their number.
  std::size_t serve_singly(EventSpan requests, TimeNs end, TimeNs delay, std::vector<Event>& served);

  std::int64_t dropped() const { return dropped_; }
  std::size_t waiting() const { return waiting_; }

  /// Its state, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.free_at_);
    archive.fixed(self.rows_);
    archive.list(self.slots_);
    archive.value(self.free_slot_);
    archive.fixed(self.queue_);
    archive.value(self.first_in_queue_);
    archive.value(self.queue_length_);
    archive.value(self.waiting_);
    archive.value(self.dropped_);
  }

 private:
  /// Times in 1/1024 ns: fine enough for any rate, and 104 days long.
  using FineTime = std::int64_t;
  static constexpr int kFineBits = 10;
  static constexpr FineTime kNs = FineTime{1} << kFineBits;

  /// Makes the reader busy from `start` on with `count` events of a row.
  void occupy(TimeNs start, std::uint32_t count) {
    const FineTime busy = std::max(per_row_ + per_event_ * static_cast<FineTime>(count), kNs);
    // Fractions of a nanosecond are kept while the reader is continuously busy.
    free_at_ = (start > free_from() ? start << kFineBits : free_at_) + busy;
  }
  TimeNs free_from() const { return (free_at_ + kNs - 1) >> kFineBits; }  ///< first whole ns without work

  FineTime per_event_, per_row_;
  std::size_t capacity_;
  FineTime free_at_ = std::numeric_limits<FineTime>::min();  // time at which the reader is free

  /// The waiting requests of a row: the first one, and a list of slots.
  struct Row {
    Event first;
    std::uint32_t count = 0, others = 0;
  };
  struct Slot {
    Event request;
    std::uint32_t next;
  };
  std::vector<Row> rows_;
  std::vector<Slot> slots_;
  std::uint32_t free_slot_ = 0;  // head of the list of free slots

  // Rows with requests, in the order of their first requests: a ring buffer.
  std::vector<std::uint16_t> queue_;
  std::size_t first_in_queue_ = 0, queue_length_ = 0;

  std::vector<Event> served_;  // by the last serve()
  std::size_t waiting_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace esim::inline event_camera
