#include "esim/filters/rate_controller.h"

#include <algorithm>
#include <cmath>

#include "esim/filters/windows.h"

namespace esim::inline filters {
namespace {

/// The fractional part of n times the golden ratio: evenly spread on [0, 1) for consecutive n.
double fraction_of_golden_ratio(std::int64_t n) {
  return static_cast<double>(static_cast<std::uint64_t>(n) * 0x9E37'79B9'7F4A'7C15U >> 11) * 0x1.0p-53;
}

}  // namespace

RateController::RateController(const RateControllerOptions& options)
    : period_(std::llround(options.period_us * 1e3)), limit_(options.events_per_period) {}

void RateController::process(EventSpan events, std::vector<Event>& out) {
  for (const Event& event : events) {
    const std::int64_t index = window_index(event.t, period_);
    if (index_ && index != *index_) {
      expected_ = index == *index_ + 1 ? arrived_ : 0;
      // Starts at another place in each period, so that periods with the same number of events drop different ones.
      remainder_ = static_cast<std::int64_t>(fraction_of_golden_ratio(index) * static_cast<double>(expected_));
      arrived_ = passed_ = 0;
    }
    index_ = index;
    ++arrived_;
    bool passes = passed_ < limit_;
    if (expected_ > limit_) {
      remainder_ += limit_;
      const bool due = remainder_ >= expected_;
      if (due) remainder_ -= expected_;
      passes = passes && due;
    }
    if (passes) {
      ++passed_;
      out.push_back(event);
    } else {
      ++dropped_;
    }
  }
}

}  // namespace esim::inline filters
