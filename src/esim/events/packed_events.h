#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/events/event_label.h"
#include "esim/events/event_packing.h"

namespace esim::inline events {

/// The packed events that one thread has generated, in any order but separated into time ranges, so that each range can
/// be sorted independently.
class PackedEvents {
 public:
  static constexpr std::size_t kRanges = 8;

  /// Expects events within `duration` after packing.origin. Later events are possible, but all go to the last range.
  void expect(const EventPacking& packing, TimeNs duration);

  const EventPacking& packing() const { return packing_; }

  /// Labels of the events, in the order of each pixel's events; only if they are wanted. clear() keeps them.
  std::vector<NewLabel> labels;

  /// Adds `count` events, except those with `reported` = 0. `time` is in whole ns after `start`.
  void add(std::size_t count, TimeNs start, const double* time, const std::uint32_t* place, const double* polarity,
           const double* reported);

  std::span<const std::uint64_t> range(std::size_t i) const { return {ranges_[i].data(), sizes_[i]}; }
  std::size_t size() const;
  void clear() { sizes_.fill(0); }

 private:
  EventPacking packing_{1, 1};
  int shift_ = 0;
  std::array<std::vector<std::uint64_t>, kRanges> ranges_;
  std::array<std::size_t, kRanges> sizes_{};
};

}  // namespace esim::inline events
