#include "esim/reproject/spline_coefficients.h"

#include <algorithm>

namespace esim::inline reproject {
namespace {

constexpr float kPole = -0.26794919243F;  // sqrt(3) - 2: pole of the recursive filter in both directions
constexpr int kMemory = 14;               // higher powers of the pole are below float precision

/// Filters `lanes` adjacent lines of `count` values, `stride` apart.
void filter(float* values, int count, std::ptrdiff_t stride, int lanes) {
  const auto line = [&](int i) { return values + stride * i; };
  float* const first = line(0);
  float power = kPole;
  for (int k = 1; k < std::min(count, kMemory); ++k, power *= kPole) {
    const float* const at = line(k);
    for (int i = 0; i < lanes; ++i) first[i] += power * at[i];
  }
  for (int k = 1; k < count; ++k) {
    float *const at = line(k), *const before = line(k - 1);
    for (int i = 0; i < lanes; ++i) at[i] += kPole * before[i];
  }
  float *const last = line(count - 1), *const next_to_last = line(count - 2);
  constexpr float kEnd = kPole / (kPole * kPole - 1);
  for (int i = 0; i < lanes; ++i) last[i] = kEnd * (last[i] + kPole * next_to_last[i]);
  for (int k = count - 2; k >= 0; --k) {
    float *const at = line(k), *const after = line(k + 1);
    for (int i = 0; i < lanes; ++i) at[i] = kPole * (after[i] - at[i]);
  }
  for (int k = 0; k < count; ++k) {
    float* const at = line(k);
    for (int i = 0; i < lanes; ++i) at[i] *= 6;
  }
}

}  // namespace

void to_spline_coefficients(Image<float>& image, const Workers& workers) {
  constexpr int kLanes = 64;
  const int width = image.width(), height = image.height();
  workers.for_each(height, [&](int y) { filter(image.row(y), width, 1, 1); });
  workers.for_each((width + kLanes - 1) / kLanes, [&](int i) {
    filter(image.data() + i * kLanes, height, width, std::min(kLanes, width - i * kLanes));
  });
}

}  // namespace esim::inline reproject
