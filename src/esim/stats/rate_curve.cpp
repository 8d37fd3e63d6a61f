#include "esim/stats/rate_curve.h"

#include <algorithm>
#include <utility>

namespace esim::inline stats {

void RateCurve::start_window(std::int64_t ms) {
  close_window();
  // Windows without events replace older ones among the last ten.
  for (std::int64_t passed = std::max(ms_ + 1, ms - 9); passed <= ms; ++passed) {
    recent_sum_ -= std::exchange(recent_[static_cast<std::size_t>(passed % 10)], 0);
  }
  ms_ = ms;
}

void RateCurve::close_window() {
  const std::uint64_t events = window_.on + window_.off;
  if (events == 0) return;
  recent_[static_cast<std::size_t>(ms_ % 10)] += events;
  recent_sum_ += events;
  max_in_1_ = std::max(max_in_1_, events);
  max_in_10_ = std::max(max_in_10_, recent_sum_);

  const auto ms = static_cast<std::uint64_t>(ms_);
  while ((ms >> doublings_) >= kMaxBins) {
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      const Bin bin = std::exchange(bins_[i], Bin{});
      bins_[i / 2].on += bin.on;
      bins_[i / 2].off += bin.off;
    }
    bins_.resize((bins_.size() + 1) / 2);
    ++doublings_;
  }
  const std::size_t bin = ms >> doublings_;
  if (bin >= bins_.size()) bins_.resize(bin + 1);
  bins_[bin].on += window_.on;
  bins_[bin].off += window_.off;
  window_ = {};
}

}  // namespace esim::inline stats
