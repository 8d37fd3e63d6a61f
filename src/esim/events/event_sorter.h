#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/events/event_buffer.h"
#include "esim/events/event_packing.h"

namespace esim {

/// Brings packed events into their order: a radix sort by time, over as many digits as their times differ in. Keeps
/// memory to work in.
class EventSorter {
 public:
  /// Moves the events of all parts, each in any order, to `sorted`, whose content is replaced.
  void sort(std::span<std::vector<std::uint64_t>> parts, const EventPacking& packing, const Workers& workers,
            EventBuffer& sorted);

 private:
  void scatter(std::span<std::vector<std::uint64_t>> parts, int shift, std::size_t ranges, std::uint64_t first,
               const Workers& workers);

  std::vector<std::uint64_t> keys_, scratch_;
  std::vector<std::uint32_t> positions_;  // by part and range
  std::vector<std::uint32_t> begins_;     // by range
};

}  // namespace esim
