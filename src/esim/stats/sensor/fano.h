#pragma once

#include <cstdint>
#include <limits>

namespace esim::inline stats {

/// The Fano factor of counts: their variance over their mean, in consecutive bins from the first event on. The last
/// bin, which is not complete, does not count. It is 1 for a Poisson process, and larger if events come in bursts.
class Fano {
 public:
  explicit Fano(std::int64_t bin_us) : bin_us_(bin_us) {}

  /// Time since the first event, us; never decreasing.
  void add(std::int64_t since_start_us) {
    const std::int64_t bin = since_start_us / bin_us_;
    if (bin != bin_) {
      sum_ += count_;
      squares_ += count_ * count_;
      count_ = 0;
      bin_ = bin;
    }
    ++count_;
  }

  std::int64_t bin_us() const { return bin_us_; }

  /// NaN with fewer than two complete bins or without events in them.
  double factor() const {
    if (bin_ < 2 || sum_ == 0) return std::numeric_limits<double>::quiet_NaN();
    const double bins = static_cast<double>(bin_), mean = static_cast<double>(sum_) / bins;
    return static_cast<double>(squares_) / bins / mean - mean;
  }

 private:
  std::int64_t bin_us_, bin_ = 0;
  std::uint64_t count_ = 0, sum_ = 0, squares_ = 0;  // of the open bin; of the complete bins
};

}  // namespace esim::inline stats
