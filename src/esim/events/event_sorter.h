#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event_buffer.h"
#include "esim/events/packed_events.h"

namespace esim::inline events {

/// Sorts packed events: a radix sort of each time range, over the digits in which its times differ. Keeps its working
/// memory.
class EventSorter {
 public:
  /// Moves the events of all parts, which must have the same packing, to `sorted`, whose content is replaced.
  void sort(std::span<PackedEvents> parts, const Workers& workers, EventBuffer& sorted);

 private:
  static void sort_range(std::span<PackedEvents> parts, std::size_t range, std::span<std::uint64_t> keys,
                         std::span<std::uint64_t> scratch, int time_shift);

  std::vector<std::uint64_t> keys_, scratch_;
};

}  // namespace esim::inline events
