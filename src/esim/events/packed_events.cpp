#include "esim/events/packed_events.h"

namespace esim::inline events {

void PackedEvents::add(std::size_t count, TimeNs start, const double* time, const std::uint32_t* place,
                       const double* polarity, const double* reported) {
  if (events_.size() < size_ + count) events_.resize(2 * (size_ + count));
  // Without branches: the pixels that fire are hard to predict.
  const EventPacking packing = packing_;
  const TimeNs begin = start - packing.origin;
  std::uint64_t* end = events_.data() + size_;
  for (std::size_t i = 0; i < count; ++i) {
    *end = packing.pack(begin + static_cast<TimeNs>(time[i]), place[i], polarity[i] > 0);
    end += reported[i] != 0;
  }
  size_ = static_cast<std::size_t>(end - events_.data());
}

}  // namespace esim::inline events
