#include "esim/stats/time_sample.h"

namespace esim::inline stats {

void TimeSample::thin() {
  ++min_zeros_;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < times_.size(); ++i) {
    if (zeros_[i] < min_zeros_) continue;
    times_[kept] = times_[i];
    zeros_[kept++] = zeros_[i];
  }
  times_.resize(kept);
  zeros_.resize(kept);
}

}  // namespace esim::inline stats
