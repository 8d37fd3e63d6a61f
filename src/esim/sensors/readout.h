#pragma once

#include <cstdint>
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

  /// What it remembers, for state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.free_at_);
    archive.list(self.slots_);
    archive.value(self.free_slot_);
    archive.fixed(self.rows_);
    archive.fixed(self.requests_);
    archive.value(self.first_request_);
    archive.value(self.request_count_);
    archive.value(self.waiting_);
    archive.value(self.dropped_);
  }

 private:
  /// Times in 1/1024 ns: fine enough for any rate, and 104 days long.
  using FineTime = std::int64_t;
  static constexpr int kFineBits = 10;
  static constexpr FineTime kNs = FineTime{1} << kFineBits;

  /// The events of a row that wait: the first of them, and a list of slots.
  struct Row {
    std::uint32_t count = 0, others = 0;
    std::uint16_t x = 0;
    std::int8_t polarity = 0;
  };

  void serve_until(TimeNs now, std::vector<Event>& out);
  void serve(const Row& row, std::uint16_t y, TimeNs t, std::vector<Event>& out);
  void accept(const Event& event);
  void occupy(TimeNs start, std::uint32_t count);
  TimeNs free_from() const { return (free_at_ + kNs - 1) >> kFineBits; }  ///< first whole ns without work

  FineTime per_event_, per_row_;
  std::size_t capacity_;
  FineTime free_at_ = std::numeric_limits<FineTime>::min();  // when the reader is done

  struct Slot {
    std::uint16_t x;
    std::int8_t polarity;
    std::uint32_t next;
  };
  std::vector<Slot> slots_;
  std::uint32_t free_slot_ = 0;  // first of the list of those that are free
  std::vector<Row> rows_;

  // Rows with events, in the order of their first: a ring.
  struct Request {
    TimeNs t;
    std::uint16_t row;
  };
  std::vector<Request> requests_;
  std::size_t first_request_ = 0, request_count_ = 0;

  std::size_t waiting_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace esim
