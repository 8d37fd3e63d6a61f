#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event_buffer.h"
#include "esim/events/packed_events.h"

namespace esim {

/// Brings packed events into their order: a radix sort of each range of time, over as many digits as its times differ
/// in. Keeps memory to work in.
class EventSorter {
 public:
  /// Moves the events of all parts, of one packing, to `sorted`, whose content is replaced.
  void sort(std::span<PackedEvents> parts, const Workers& workers, EventBuffer& sorted);

 private:
  static void sort_range(std::span<PackedEvents> parts, std::size_t range, std::span<std::uint64_t> keys,
                         std::span<std::uint64_t> scratch, int time_shift);

  std::vector<std::uint64_t> keys_, scratch_;
};

}  // namespace esim
