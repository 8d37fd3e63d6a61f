#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace esim::inline fit {

/// A parameter of a sensor, as found from recordings.
struct Estimate {
  std::string name;  ///< as in the options of an event camera: "circuit.threshold_mismatch_common"
  std::string unit;  ///< empty for pure numbers
  double value = std::numeric_limits<double>::quiet_NaN();
  double low = value, high = value;  ///< 95 % interval
  std::string source;                ///< what it was found from, in a few words
  std::string reason;                ///< why it is not determined; empty if it is

  bool determined() const { return reason.empty(); }

  static Estimate found(std::string name, std::string unit, double value, double low, double high, std::string source) {
    return {std::move(name), std::move(unit), value, low, high, std::move(source), {}};
  }
  static Estimate unknown(std::string name, std::string unit, std::string why) {
    Estimate e;
    e.name = std::move(name), e.unit = std::move(unit), e.reason = std::move(why);
    return e;
  }
};

/// A bar chart of measured values, with the fitted density.
struct FittedDistribution {
  std::string title, axis;  ///< "ON thresholds of the pixels", "threshold (ln)"
  std::vector<double> values;
  std::function<double(double)> density;
};

/// 97.5 % quantile of the standard normal distribution: for intervals that contain 95 %.
inline constexpr double kNormalQuantile = 1.959964;

inline std::function<double(double)> normal_density(double centre, double deviation) {
  return [=](double x) {
    const double z = (x - centre) / deviation;
    return std::exp(-0.5 * z * z) / (deviation * std::sqrt(2 * std::numbers::pi));
  };
}

/// The same of Student's t distribution, by the expansion of Cornish and Fisher: within 0.3 % for 8 or
/// more degrees of freedom (Abramowitz and Stegun, 26.7.5).
inline double student_quantile(double degrees) {
  constexpr double z = kNormalQuantile, z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * degrees) + (5 * z5 + 16 * z3 + 3 * z) / (96 * degrees * degrees) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * degrees * degrees * degrees);
}

}  // namespace esim::inline fit
