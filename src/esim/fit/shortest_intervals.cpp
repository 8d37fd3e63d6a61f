#include "esim/fit/shortest_intervals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim::inline fit {
namespace {

constexpr std::size_t kFewestPairs = 100;
constexpr double kStepDistance = 1.63;  // Kolmogorov-Smirnov at 1 %, times the root of the number
// Quantiles of the exponential distribution, for 95 %, and its mean.
constexpr double kLow = 0.0253, kHigh = 3.6889;

}  // namespace

void ShortestIntervals::add(EventSpan events) {
  for (const Event& event : events) {
    TimeNs& last = last_(event.x, event.y);
    if (last != kNone) {
      const TimeNs interval = event.t - last;
      if (heap_.size() < kKept) {
        heap_.push_back(interval);
        std::push_heap(heap_.begin(), heap_.end());
      } else if (interval < heap_.front()) {
        std::pop_heap(heap_.begin(), heap_.end());
        heap_.back() = interval;
        std::push_heap(heap_.begin(), heap_.end());
      }
    }
    last = event.t;
  }
}

ShortestIntervals::Result ShortestIntervals::finish(TimeNs stamp_unit) const {
  Result result;
  std::vector<TimeNs> sorted = heap_;
  std::sort(sorted.begin(), sorted.end());
  for (const TimeNs interval : sorted) result.intervals_us.push_back(1e-3 * static_cast<double>(interval));
  result.shortest_us = sorted.empty() ? std::numeric_limits<double>::quiet_NaN() : result.intervals_us.front();
  const auto unknown = [&](std::string why) {
    result.refractory = Estimate::unknown("refractory_period_us", "us", std::move(why));
    return result;
  };
  if (sorted.size() < kFewestPairs) {
    return unknown(
        fmt::format("only {} pairs of events of a pixel; at least {} are necessary", sorted.size(), kFewestPairs));
  }
  const std::vector<double>& t = result.intervals_us;
  const auto n = static_cast<double>(t.size() - 1);
  const double reach = t.back() - t.front(), unit = 1e-3 * static_cast<double>(stamp_unit);
  double distance = 1;
  if (reach > 0) {
    distance = 0;
    for (std::size_t i = 1; i < t.size(); ++i) {
      const double at = (t[i] - t.front()) / reach, rank = static_cast<double>(i) / n;
      distance = std::max({distance, std::abs(at - rank), std::abs(at - rank + 1 / n)});
    }
  }
  if (distance > kStepDistance / std::sqrt(n) + unit / std::max(reach, unit)) {
    return unknown(
        fmt::format("short intervals do not begin with a step, so that the shortest one, {:.4g} us, is only "
                    "an upper limit; record constant, dim light, or fast edges",
                    t.front()));
  }
  const double mean = reach / n;  // between the shortest intervals
  // Rounded time stamps move an interval by up to their unit.
  result.refractory = Estimate::found("refractory_period_us", "us", std::max(0.0, t.front() - mean),
                                      std::max(0.0, t.front() - kHigh * mean - unit), t.front() - kLow * mean + unit,
                                      "shortest intervals between events");
  return result;
}

}  // namespace esim::inline fit
