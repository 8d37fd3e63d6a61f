#include "esim/events/packed_events.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace esim::inline events {

void PackedEvents::expect(const EventPacking& packing, TimeNs duration) {
  packing_ = packing;
  constexpr int kRangeBits = std::bit_width(kRanges) - 1;
  shift_ = packing.time_shift() +
           std::max(0, static_cast<int>(std::bit_width(static_cast<std::uint64_t>(duration))) - kRangeBits);
}

void PackedEvents::add(std::size_t count, TimeNs start, const double* time, const std::uint32_t* place,
                       const double* polarity, const double* reported) {
  std::array<std::uint64_t*, kRanges> ends;
  for (std::size_t r = 0; r < kRanges; ++r) {
    if (ranges_[r].size() < sizes_[r] + count) ranges_[r].resize(2 * (sizes_[r] + count));
    ends[r] = ranges_[r].data() + sizes_[r];
  }
  // Without branches: the pixels that fire are hard to predict.
  const EventPacking packing = packing_;
  const TimeNs begin = start - packing.origin;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t key = packing.pack(begin + static_cast<TimeNs>(time[i]), place[i], polarity[i] > 0);
    const std::uint64_t range = std::min<std::uint64_t>(key >> shift_, kRanges - 1);
    *ends[range] = key;
    ends[range] += reported[i] != 0;
  }
  for (std::size_t r = 0; r < kRanges; ++r) sizes_[r] = static_cast<std::size_t>(ends[r] - ranges_[r].data());
}

std::size_t PackedEvents::size() const { return std::accumulate(sizes_.begin(), sizes_.end(), std::size_t{0}); }

}  // namespace esim::inline events
