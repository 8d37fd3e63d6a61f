#include <cmath>
#include <limits>

#include "esim/sampling/criterion.h"
#include "esim/sampling/row_maximum.h"

namespace esim::inline sampling {

double fastest_motion_px_per_s(const Sample& sample, const Workers& workers) {
  const int width = sample.motion_x.width();
  const float squared = row_maximum(sample.motion_x.height(), workers, [&](int y) {
    const float *const vx = sample.motion_x.row(y), *const vy = sample.motion_y.row(y);
    float maximum = 0;
#pragma omp simd reduction(max : maximum)
    for (int x = 0; x < width; ++x) {
      const float v2 = vx[x] * vx[x] + vy[x] * vy[x];
      maximum = v2 > maximum && v2 <= std::numeric_limits<float>::max() ? v2 : maximum;
    }
    return maximum;
  });
  return std::sqrt(double{squared});
}

double wanted_interval_s(const FlowSampling& options, const SensorTraits&, const Sample& sample,
                         const Workers& workers) {
  return options.lambda / fastest_motion_px_per_s(sample, workers);
}

}  // namespace esim::inline sampling
