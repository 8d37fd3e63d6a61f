#pragma once

#include <span>

#include "esim/core/log_histogram.h"
#include "esim/sampling/measured_error.h"

namespace esim {

/// What an interval may have: ln units, and those squared times ns.
struct ErrorLimits {
  double error = 0;   ///< e_0 times the 99th percentile of a normal deviate: the tolerance, or less
  double energy = 0;  ///< e_0^2 h_0
};

/// How much error a tile's interval between two samples may have, and what audits say of what came of it.
///
/// The energy of an interval is its mean square error e^2, of brightness, times its duration h. A sample more takes
/// much of an interval's energy away, and costs the same wherever it is: a mean square error is had with the fewest
/// samples if all intervals have the same energy, e_0^2 h_0. Here h_0 is the typical interval of late. Each audit
/// moves e_0 towards where 1 % of the audited errors, in tiles in which something changes, are above the tolerance: how
/// e^2 is spread over pixels and time, no mean square tells.
class ErrorBudget {
 public:
  /// 99 % of the errors are to stay below `tolerance`, ln units.
  explicit ErrorBudget(double tolerance) : tolerance_(tolerance) {}

  ErrorLimits limits() const;

  /// h_0, ns; 0 before any interval was remembered.
  double typical_interval() const;

  /// Takes note of the lengths of some intervals: ln ns, added up.
  void remember(double log_intervals, int count);

  /// Takes an audit of a tile: the error of each pixel in the middle of an interval that lasts `duration`, and by how
  /// much the brightness of the one that changes most does in it.
  void audit(std::span<const float> errors, float most_change, double duration);

  MeasuredError measured() const { return measured_error(audited_); }

 private:
  double tolerance_;
  double gain_ = 0.5;                         // e_0 over what it would be for normal errors; careful at first
  double log_intervals_ = 0, intervals_ = 0;  // of late: ln ns added up, and how many
  LogHistogram audited_;
  double steering_audits_ = 0;  // of tiles in which something changes
};

}  // namespace esim
