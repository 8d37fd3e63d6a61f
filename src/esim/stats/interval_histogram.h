#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/time.h"

namespace esim::inline stats {

/// Number of time intervals in bins of equal logarithmic width: 40 per decade from 1 us to 100 s, one bin for shorter
/// intervals and one for longer ones. A bin includes its lower edge.
class IntervalHistogram {
 public:
  static constexpr int kBinsPerDecade = 40, kDecades = 8;
  static constexpr int kBins = kBinsPerDecade * kDecades;  ///< without the outer two

  IntervalHistogram();

  /// `interval` >= 0, ns.
  void add(TimeNs interval) {
    ++counts_[bin_of(interval)];
    shortest_ = std::min(shortest_, interval);
    longest_ = std::max(longest_, interval);
    part_of_us_ |= interval % kNsPerUs;
  }

  std::uint64_t total() const;
  TimeNs shortest() const { return shortest_; }  ///< exact, ns; undefined without intervals
  TimeNs longest() const { return longest_; }

  std::uint64_t below() const { return counts_.front(); }
  std::uint64_t above() const { return counts_.back(); }
  std::span<const std::uint64_t, kBins> bins() const { return std::span(counts_).subspan<1, kBins>(); }

  /// Lower edge of a bin, s; edge_s(kBins) = 100 s.
  static double edge_s(int bin);

  /// The fraction of all intervals in bars of `bins_per_bar` bins each, which must divide kBins. If all intervals are
  /// whole us, as in most files, each is spread over the us that it begins: otherwise bars that are narrower than a few
  /// us would show a comb.
  std::vector<double> bars(int bins_per_bar) const;

  /// Quantile of the intervals, s, assuming that the intervals of a bin are spread evenly in the logarithm: the error
  /// is at most a bin's width, 6 %. Below 1 us the result is only a bound. NaN without intervals.
  double quantile_s(double fraction) const;

 private:
  // A lookup by octave and 1/32 of it, which holds at most one edge, followed by one comparison.
  static constexpr int kSubBits = 5;
  struct Lookup {
    std::array<TimeNs, kBins + 2> upper_edge{};  // ns, of each counter; the last has none
    std::array<std::uint16_t, 64 << kSubBits> first{};
  };
  static Lookup make_lookup();
  static const Lookup& lookup();

  std::size_t bin_of(TimeNs interval) const {
    const auto ns = std::max(static_cast<std::uint64_t>(interval), std::uint64_t{1} << kSubBits);  // far below 1 us
    const int octave = static_cast<int>(std::bit_width(ns)) - 1;
    const std::size_t part = (ns >> (octave - kSubBits)) & ((std::size_t{1} << kSubBits) - 1);
    const std::size_t bin = lookup_->first[(static_cast<std::size_t>(octave) << kSubBits) + part];
    return bin + (interval >= lookup_->upper_edge[bin] ? 1 : 0);
  }

  const Lookup* lookup_;
  std::array<std::uint64_t, kBins + 2> counts_{};
  TimeNs shortest_ = std::numeric_limits<TimeNs>::max(), longest_ = 0;
  TimeNs part_of_us_ = 0;  // 0: all are whole us
};

}  // namespace esim::inline stats
