#include "esim/scene/sprite.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/error.h"

namespace esim::inline scene {
namespace {

using Parameters = SpriteMotion::Parameters;

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// Second derivatives of the natural cubic spline through `values` (zero at both ends), from the tridiagonal system
///     h_{i-1} a_{i-1} + 2 (h_{i-1} + h_i) a_i + h_i a_{i+1} = 6 (slope_i - slope_{i-1}).
std::vector<Parameters> natural_spline(const std::vector<double>& t, const std::vector<Parameters>& values) {
  const std::size_t n = t.size();
  std::vector<Parameters> a(n, Parameters::Zero());
  std::vector<double> ratio(n, 0.0);
  const auto slope = [&](std::size_t i) -> Parameters { return (values[i + 1] - values[i]) / (t[i + 1] - t[i]); };
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double before = t[i] - t[i - 1], after = t[i + 1] - t[i];
    const double pivot = 2 * (before + after) - before * ratio[i - 1];
    ratio[i] = after / pivot;
    a[i] = (6 * (slope(i) - slope(i - 1)) - before * a[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) a[i] -= ratio[i] * a[i + 1];
  return a;
}

}  // namespace

SpriteMotion::SpriteMotion(const std::vector<SpritePose>& poses, SpriteInterpolation interpolation) {
  if (poses.empty()) throw UserError("has no poses; add at least one, or remove the list");
  for (const SpritePose& key : poses) {
    if (!t_s_.empty() && !(key.t_s > t_s_.back())) {
      throw UserError(
          fmt::format("the times of poses must increase, but t_s = {} follows {}; sort them, and use each time once",
                      key.t_s, t_s_.back()));
    }
    t_s_.push_back(key.t_s);
    Parameters value;
    value << key.position, key.rotation_deg * kRadiansPerDegree, key.scale, key.shear;
    values_.push_back(value);
  }
  if (interpolation == SpriteInterpolation::spline) {
    accelerations_ = natural_spline(t_s_, values_);
  } else {
    accelerations_.assign(t_s_.size(), Parameters::Zero());
  }
}

SpriteMotion::State SpriteMotion::at(TimeNs t) const {
  const double now_s = to_seconds(t);
  if (now_s < t_s_.front() || t_s_.size() == 1) return {values_.front(), Parameters::Zero()};
  if (now_s > t_s_.back()) return {values_.back(), Parameters::Zero()};

  // Between poses i and i + 1; at the last pose the velocity is still that of the motion.
  const auto next = std::upper_bound(t_s_.begin(), t_s_.end() - 1, now_s);
  const auto i = static_cast<std::size_t>(next - t_s_.begin()) - 1;
  const double h = t_s_[i + 1] - t_s_[i], p = (t_s_[i + 1] - now_s) / h, q = (now_s - t_s_[i]) / h;
  const Parameters &a = accelerations_[i], &b = accelerations_[i + 1];
  return {p * values_[i] + q * values_[i + 1] + h * h / 6 * ((p * p * p - p) * a + (q * q * q - q) * b),
          (values_[i + 1] - values_[i]) / h + h / 6 * ((1 - 3 * p * p) * a + (3 * q * q - 1) * b)};
}

SpritePlacement place(const SpriteMotion::State& state, SpriteUnits units, PixelSize image, PixelSize sensor,
                      const Eigen::Vector2d& pivot) {
  const Eigen::Vector2d sensor_size(sensor.width, sensor.height);
  Eigen::Vector2d unit = Eigen::Vector2d::Ones(), extent(image.width, image.height);
  if (units == SpriteUnits::sensor) unit = sensor_size, extent = Eigen::Vector2d::Ones();

  const double c = std::cos(state.value[2]), s = std::sin(state.value[2]);
  Eigen::Matrix2d R, R_rate;
  R << c, -s, s, c;
  R_rate << -s, -c, c, -s;
  R_rate *= state.rate[2];

  const auto U = unit.asDiagonal(), I = extent.asDiagonal();
  // K diag(scale), and its rate.
  const Eigen::Vector2d scale = state.value.segment<2>(3), scale_rate = state.rate.segment<2>(3);
  const double shear = state.value[5], shear_rate = state.rate[5];
  Eigen::Matrix2d S, S_rate;
  S << scale.x(), shear * scale.y(), 0, scale.y();
  S_rate << scale_rate.x(), shear_rate * scale.y() + shear * scale_rate.y(), 0, scale_rate.y();

  SpritePlacement placement;
  placement.A = U * R * S * I;
  placement.A_rate = U * R_rate * S * I;
  placement.A_rate += U * R * S_rate * I;
  const Eigen::Vector2d to_middle = Eigen::Vector2d::Constant(0.5) - pivot;
  placement.centre = (sensor_size - Eigen::Vector2d::Ones()) / 2 + U * state.value.head<2>() + placement.A * to_middle;
  placement.centre_velocity = U * state.rate.head<2>() + placement.A_rate * to_middle;
  return placement;
}

}  // namespace esim::inline scene
