#include <cmath>
#include <limits>

#include "esim/core/fast_log.h"
#include "esim/sampling/criterion.h"
#include "esim/sampling/row_maximum.h"

namespace esim::inline sampling {

double fastest_brightness_change_per_s(const Sample& sample, double log_eps, const Workers& workers, bool mosaic) {
  const Image<float>& irradiance = sample.irradiance;
  const int width = irradiance.width(), height = irradiance.height();
  const float eps = static_cast<float>(log_eps);
  const int reach = mosaic ? 2 : 1;  // at the border
  return row_maximum(height, workers, [&](int y) {
    // Central differences of L = ln(E + eps), as logarithms of ratios; one-sided at the image's border, where a mosaic
    // also uses pixels of the same colour.
    const int above = std::max(y == height - 1 ? y - reach : y - 1, 0);
    const int below = std::min(y == 0 ? y + reach : y + 1, height - 1);
    const float *const row = irradiance.row(y), *const row_above = irradiance.row(above),
                       *const row_below = irradiance.row(below);
    const float *const vx = sample.motion_x.row(y), *const vy = sample.motion_y.row(y);
    const float per_dy = below > above ? 1.0F / static_cast<float>(below - above) : 0.0F;
    const auto rate_at = [&](int x, int left, int right, float per_dx) {
      const float gradient_x = fast_log((row[right] + eps) / (row[left] + eps)) * per_dx;
      const float gradient_y = fast_log((row_below[x] + eps) / (row_above[x] + eps)) * per_dy;
      const float rate = std::fabs(gradient_x * vx[x] + gradient_y * vy[x]);
      return rate <= std::numeric_limits<float>::max() ? rate : 0.0F;
    };
    float maximum = 0;
#pragma omp simd reduction(max : maximum)
    for (int x = 1; x < width - 1; ++x) {
      const float rate = rate_at(x, x - 1, x + 1, 0.5F);
      maximum = rate > maximum ? rate : maximum;
    }
    if (width > reach) {
      const float per_dx = 1.0F / static_cast<float>(reach);
      maximum =
          std::max({maximum, rate_at(0, 0, reach, per_dx), rate_at(width - 1, width - 1 - reach, width - 1, per_dx)});
    }
    return maximum;
  });
}

double wanted_interval_s(const BrightnessSampling& options, const SensorTraits& sensor, const Sample& sample,
                         const Workers& workers) {
  return options.lambda * sensor.contrast_threshold /
         fastest_brightness_change_per_s(sample, sensor.log_eps, workers, sensor.mosaic);
}

}  // namespace esim::inline sampling
