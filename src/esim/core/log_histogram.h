#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace esim::inline core {

/// Mean, maximum and quantiles of values >= 0. Weights are collected in bins a hundredth of a decade wide (2.3 %), from
/// 1e-9 to 1e3; values outside belong to the outermost bins.
class LogHistogram {
 public:
  void add(double value, double weight = 1) {
    const double position = value > 0 ? (std::log10(value) - kLowest) * kPerDecade : 0.0;
    weights_[static_cast<std::size_t>(std::fmin(std::fmax(position, 0.0), kBins - 1.0))] += weight;
    total_ += weight, sum_ += weight * value, max_ = std::fmax(max_, value);
  }

  double total() const { return total_; }
  double mean() const { return total_ > 0 ? sum_ / total_ : 0; }
  double max() const { return max_; }

  /// The value that a fraction of the weight does not exceed: the upper edge of its bin. 0 without values.
  double quantile(double fraction) const {
    if (total_ == 0) return 0;
    double below = 0;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      below += weights_[i];
      if (below >= fraction * total_) return std::pow(10.0, kLowest + (static_cast<double>(i) + 1) / kPerDecade);
    }
    return 1e3;
  }

 private:
  static constexpr int kLowest = -9, kPerDecade = 100, kBins = 12 * kPerDecade;
  std::array<double, kBins> weights_{};
  double total_ = 0, sum_ = 0, max_ = 0;
};

}  // namespace esim::inline core
