#include "esim/preview/scales.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace esim::inline preview {
namespace {

constexpr std::size_t kSamples = 20'000;
constexpr float kMinRatio = 1.5f;  // minimum ratio of far to near

float quantile(std::vector<float>& values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Rounds down or up to two significant digits, so that the legend has short numbers.
float two_digits(float value, bool up) {
  const double unit = std::pow(10.0, std::floor(std::log10(static_cast<double>(value))) - 1.0);
  const double steps = static_cast<double>(value) / unit;
  return static_cast<float>((up ? std::ceil(steps - 1e-4) : std::floor(steps + 1e-4)) * unit);
}

float next_round(float value) {
  const double decade = std::pow(10.0, std::floor(std::log10(static_cast<double>(value))));
  for (const double step : {1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (static_cast<double>(value) <= step * decade * 1.0001) return static_cast<float>(step * decade);
  }
  return static_cast<float>(10.0 * decade);
}

std::size_t stride_of(const Image<float>& image) { return std::max<std::size_t>(1, image.size() / kSamples); }

}  // namespace

void DepthScale::include(const Image<float>& depth_m) {
  std::vector<float> values;
  for (std::size_t i = 0; i < depth_m.size(); i += stride_of(depth_m)) {
    const float depth = depth_m.pixels()[i];
    if (depth > 1e-6f && depth < 1e9f) values.push_back(depth);
  }
  if (values.empty()) return;
  const float low = quantile(values, 0.01), high = quantile(values, 0.99);
  const bool first = far_m_ == 0.0f;
  if (first || low < near_m_) near_m_ = two_digits(0.9f * low, false);
  if (first || high > far_m_) far_m_ = two_digits(1.1f * high, true);
  if (far_m_ < kMinRatio * near_m_) {
    const float middle = std::sqrt(near_m_ * far_m_);
    near_m_ = two_digits(middle / std::sqrt(kMinRatio), false);
    far_m_ = two_digits(middle * std::sqrt(kMinRatio), true);
  }
}

void MotionScale::include(const Image<float>& motion_x, const Image<float>& motion_y) {
  std::vector<float> speeds;
  for (std::size_t i = 0; i < motion_x.size(); i += stride_of(motion_x)) {
    const float speed = std::hypot(motion_x.pixels()[i], motion_y.pixels()[i]);
    if (std::isfinite(speed)) speeds.push_back(speed);
  }
  if (speeds.empty()) return;
  const float fast = std::min(quantile(speeds, 0.99), 1e9f);
  if (fast > full_px_per_s_) full_px_per_s_ = next_round(fast);
}

}  // namespace esim::inline preview
