#include "esim/scene/environment/split_sum.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace esim::inline scene {
namespace {

/// The integral over the directions of light, by half vectors at quantiles of the lobe's elevation, closer together
/// towards the horizon, and at equal steps of the azimuth.
SplitSum::Value integral(double cosine, double roughness) {
  constexpr int kElevations = 64, kAzimuths = 64;
  const double alpha = std::max(roughness * roughness, 1e-4), alpha2 = alpha * alpha;
  const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
  double scale = 0, offset = 0;
  for (int i = 0; i < kElevations; ++i) {
    const double left = 1 - (i + 0.5) / kElevations, quantile = 1 - left * left;
    const double n_h = std::sqrt((1 - quantile) / (1 + (alpha2 - 1) * quantile));
    const double across = std::sqrt(std::max(1 - n_h * n_h, 0.0));
    for (int j = 0; j < kAzimuths; ++j) {
      const double azimuth = std::numbers::pi * (j + 0.5) / kAzimuths;  // the other half is the same
      const double v_h = sine * across * std::cos(azimuth) + cosine * n_h;
      const double n_l = 2 * v_h * n_h - cosine;
      if (!(n_l > 0) || !(v_h > 0)) continue;
      const double visibility = 0.5 / (n_l * std::sqrt(alpha2 + (1 - alpha2) * cosine * cosine) +
                                       cosine * std::sqrt(alpha2 + (1 - alpha2) * n_l * n_l));
      const double weight = 2 * left * 4 * visibility * n_l * v_h / n_h, schlick = std::pow(1 - v_h, 5);
      scale += weight * (1 - schlick), offset += weight * schlick;
    }
  }
  constexpr double kCount = kElevations * kAzimuths;
  return {static_cast<float>(scale / kCount), static_cast<float>(offset / kCount)};
}

}  // namespace

SplitSum::SplitSum() {
  for (std::size_t row = 0; row < kSize; ++row) {
    for (std::size_t column = 0; column < kSize; ++column) {
      const double cosine = std::max(static_cast<double>(column) / (kSize - 1), 1e-3);
      values_[row * kSize + column] = integral(cosine, static_cast<double>(row) / (kSize - 1));
    }
  }
}

const SplitSum& SplitSum::table() {
  static const SplitSum kTable;
  return kTable;
}

}  // namespace esim::inline scene
