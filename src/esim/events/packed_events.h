#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/events/event_label.h"
#include "esim/events/event_packing.h"

namespace esim::inline events {

/// The packed events that one thread has generated, in any order.
class PackedEvents {
 public:
  /// Only while there are no events.
  void set_packing(const EventPacking& packing) { packing_ = packing; }
  const EventPacking& packing() const { return packing_; }

  /// Labels of the events, in the order of each pixel's events; only if they are wanted. clear() keeps them.
  std::vector<NewLabel> labels;

  /// Adds `count` events, except those with `reported` = 0. `time` is in whole ns after `start`.
  void add(std::size_t count, TimeNs start, const double* time, const std::uint32_t* place, const double* polarity,
           const double* reported);

  std::span<const std::uint64_t> events() const { return {events_.data(), size_}; }
  std::size_t size() const { return size_; }
  void clear() { size_ = 0; }

 private:
  EventPacking packing_{1, 1};
  std::vector<std::uint64_t> events_;  // with room for more
  std::size_t size_ = 0;
};

}  // namespace esim::inline events
