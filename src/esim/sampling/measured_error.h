#pragma once

#include "esim/core/log_histogram.h"

namespace esim::inline sampling {

/// Error of the brightness between samples, as measured by the scheme; in ln(E + eps).
struct MeasuredError {
  double mean = 0, p99 = 0, max = 0;
};

inline MeasuredError measured_error(const LogHistogram& errors) {
  return {errors.mean(), errors.quantile(0.99), errors.max()};
}

}  // namespace esim::inline sampling
