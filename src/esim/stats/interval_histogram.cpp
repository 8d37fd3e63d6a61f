#include "esim/stats/interval_histogram.h"

#include <cmath>
#include <numeric>

namespace esim::inline stats {

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

std::vector<double> IntervalHistogram::bars(int bins_per_bar) const {
  const int count = kBins / bins_per_bar;
  const double all = static_cast<double>(std::max<std::uint64_t>(1, total()));
  const auto edge_us = [&](int bar) { return 1e6 * edge_s(bar * bins_per_bar); };
  const auto first_us = [&](int bar) { return std::ceil(edge_us(bar) - 1e-6); };  // the first whole one
  std::vector<double> fractions(static_cast<std::size_t>(count));
  double per_us = 0;  // of the last bar that holds a whole us
  for (int bar = 0; bar < count; ++bar) {
    const auto held =
        bins().subspan(static_cast<std::size_t>(bar * bins_per_bar), static_cast<std::size_t>(bins_per_bar));
    double fraction = static_cast<double>(std::accumulate(held.begin(), held.end(), std::uint64_t{0})) / all;
    const double whole_us = first_us(bar + 1) - first_us(bar);
    if (whole_us > 0) per_us = fraction / whole_us;
    if (part_of_us_ == 0) fraction = per_us * (edge_us(bar + 1) - edge_us(bar));
    fractions[static_cast<std::size_t>(bar)] = fraction;
  }
  return fractions;
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

}  // namespace esim::inline stats
