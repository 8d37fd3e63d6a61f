#pragma once

#include <cmath>
#include <numbers>

// Private to characterise.
namespace esim::inline characterise {

/// Density and distribution function of the standard normal distribution.
inline double normal_pdf(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }
inline double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace esim::inline characterise
