#pragma once

#include <span>

#include "esim/core/log_histogram.h"
#include "esim/sampling/measured_error.h"

namespace esim::inline sampling {

/// Limits of an interval, in ln units and in ln units squared times ns.
struct ErrorLimits {
  double error = 0;   ///< e_0 times the 99th percentile of a normal deviate; at most the tolerance
  double energy = 0;  ///< e_0^2 h_0
};

/// The permitted error of a tile's interval between two samples, corrected by audits.
///
/// The energy of an interval is its mean square error of brightness, e^2, times its duration h. One more sample removes
/// most of an interval's energy and costs the same in every interval. Therefore a given mean square error needs the
/// fewest samples if all intervals have the same energy, e_0^2 h_0, where h_0 is the typical recent interval. The mean
/// square does not determine how e^2 is distributed over pixels and time: each audit moves e_0 towards the value at
/// which 1 % of the audited errors, in tiles whose brightness changes, are above the tolerance.
class ErrorBudget {
 public:
  /// 99 % of the errors must stay below `tolerance`, ln units.
  explicit ErrorBudget(double tolerance) : tolerance_(tolerance) {}

  ErrorLimits limits() const;

  /// h_0, ns; 0 before the first remember().
  double typical_interval() const;

  /// Adds `count` intervals; `log_intervals` is the sum of the logarithms of their lengths in ns.
  void remember(double log_intervals, int count);

  /// Adds an audit of a tile: the error of each pixel in the middle of an interval of this duration, and the largest
  /// change of any pixel's brightness in the interval.
  void audit(std::span<const float> errors, float most_change, double duration);

  MeasuredError measured() const { return measured_error(audited_); }

 private:
  double tolerance_;
  double gain_ = 0.5;                         // e_0 relative to its value for normally distributed errors; starts low
  double log_intervals_ = 0, intervals_ = 0;  // recent intervals: sum of ln ns, and their number
  LogHistogram audited_;
  double steering_audits_ = 0;  // of tiles whose brightness changes
};

}  // namespace esim::inline sampling
