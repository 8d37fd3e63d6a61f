#include "esim/stats/interval_histogram.h"

#include <cmath>
#include <numeric>

namespace esim {

IntervalHistogram::Lookup IntervalHistogram::make_lookup() {
  Lookup lookup;
  for (int bin = 0; bin <= kBins; ++bin) {
    lookup.upper_edge[static_cast<std::size_t>(bin)] = static_cast<TimeNs>(std::ceil(edge_s(bin) * 1e9 - 1e-3));
  }
  lookup.upper_edge.back() = std::numeric_limits<TimeNs>::max();
  for (std::size_t i = 0; i < lookup.first.size(); ++i) {
    const int octave = static_cast<int>(i >> kSubBits);
    const double part = static_cast<double>(i & ((std::size_t{1} << kSubBits) - 1)) / (1 << kSubBits);
    const double lowest = std::ldexp(1.0 + part, octave);
    const auto edge = std::upper_bound(lookup.upper_edge.begin(), lookup.upper_edge.end() - 1, lowest,
                                       [](double value, TimeNs upper) { return value < static_cast<double>(upper); });
    lookup.first[i] = static_cast<std::uint16_t>(edge - lookup.upper_edge.begin());
  }
  return lookup;
}

const IntervalHistogram::Lookup& IntervalHistogram::lookup() {
  static const Lookup kLookup = make_lookup();
  return kLookup;
}

IntervalHistogram::IntervalHistogram() : lookup_(&lookup()) {}

double IntervalHistogram::edge_s(int bin) { return 1e-6 * std::pow(10.0, static_cast<double>(bin) / kBinsPerDecade); }

std::uint64_t IntervalHistogram::total() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

double IntervalHistogram::quantile_s(double fraction) const {
  const std::uint64_t intervals = total();
  if (intervals == 0) return std::numeric_limits<double>::quiet_NaN();
  const double shortest_s = std::max(1e-9, to_seconds(shortest_)), longest_s = std::max(1e-9, to_seconds(longest_));
  double left = fraction * static_cast<double>(intervals);
  std::size_t bin = 0;
  while (bin + 1 < counts_.size() && left > static_cast<double>(counts_[bin]))
    left -= static_cast<double>(counts_[bin++]);
  const int index = static_cast<int>(bin);
  const double low = std::max(shortest_s, index == 0 ? 0.0 : edge_s(index - 1));
  const double high = std::min(longest_s, index == kBins + 1 ? longest_s : edge_s(index));
  const double part = counts_[bin] == 0 ? 0.0 : left / static_cast<double>(counts_[bin]);
  return low * std::pow(high / low, std::clamp(part, 0.0, 1.0));
}

}  // namespace esim
