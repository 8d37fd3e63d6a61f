#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esim::inline stats {

/// How often each integer >= 0 occurred: exact below 2048, in bins of at most 1/1024 of their value above.
class IntegerHistogram {
 public:
  void add(std::uint64_t value) {
    const std::size_t bin = bin_of(value);
    if (bin >= counts_.size()) counts_.resize(bin + 1);
    ++counts_[bin];
    ++total_;
  }

  /// Adds each value of another histogram `times` times.
  void add(const IntegerHistogram& other, std::uint64_t times = 1);

  std::uint64_t total() const { return total_; }

  /// Fraction of values below `limit` <= 2048; NaN without values.
  double fraction_below(std::uint64_t limit) const;

  /// The quantile as NumPy defines it by default: linear between the values in order. Values in a bin of several are
  /// assumed to be spread evenly in it. NaN without values.
  double quantile(double fraction) const;

  /// Bin i has the values from edge(i) to edge(i + 1), exclusive.
  std::span<const std::uint64_t> bins() const { return counts_; }
  static std::uint64_t edge(std::size_t bin);

 private:
  static constexpr int kBits = 10;
  static constexpr std::size_t kPerOctave = std::size_t{1} << kBits, kExact = 2 * kPerOctave;

  static std::size_t bin_of(std::uint64_t value) {
    if (value < kExact) return static_cast<std::size_t>(value);
    const int shift = static_cast<int>(std::bit_width(value)) - (kBits + 1);
    return (static_cast<std::size_t>(shift) << kBits) + static_cast<std::size_t>(value >> shift);
  }
  double value_at(std::uint64_t rank) const;

  std::vector<std::uint64_t> counts_;
  std::uint64_t total_ = 0;
};

/// The Kolmogorov-Smirnov distance of two samples: the maximum difference of their cumulative distributions. NaN if one
/// is empty.
double ks_distance(const IntegerHistogram& a, const IntegerHistogram& b);

}  // namespace esim::inline stats
