#include "esim/imu/imu.h"

#include <fmt/format.h>

#include <cmath>

#include "esim/core/error.h"

namespace esim::inline imu {
namespace {

/// Independent standard normal deviates, three for each sensor.
InertialSignals normals(const AddressedRandom& random, std::uint64_t draw) {
  InertialSignals deviates;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [a, b] = random.normals(static_cast<std::uint32_t>(axis), draw);
    deviates.angular_rate[axis] = a;
    deviates.specific_force[axis] = b;
  }
  return deviates;
}

Eigen::Matrix3d sensitivity(const InertialAxesOptions& axes) {
  const auto& m = axes.misalignment;
  Eigen::Matrix3d M;
  M << axes.scale.x(), m[0], m[1],  //
      m[2], axes.scale.y(), m[3],   //
      m[4], m[5], axes.scale.z();
  return M;
}

Eigen::Vector3d measure_axes(const InertialAxesOptions& axes, const Eigen::Vector3d& truth, const Eigen::Vector3d& bias,
                             const Eigen::Vector3d& deviates, double rate_hz) {
  const Eigen::Vector3d signal = sensitivity(axes) * truth + bias + axes.noise_density * std::sqrt(rate_hz) * deviates;
  if (axes.range == 0) return signal;
  return signal.cwiseMax(-axes.range).cwiseMin(axes.range);
}

Eigen::Vector3d catmull_rom(const Eigen::Vector3d& before, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& after, double u) {
  const Eigen::Vector3d slope_a = 0.5 * (b - before), slope_b = 0.5 * (after - a);
  return a + u * (slope_a + u * (3 * (b - a) - 2 * slope_a - slope_b + u * (2 * (a - b) + slope_a + slope_b)));
}

void require(bool valid, const std::string& field, const char* rule) {
  if (!valid) throw UserError(fmt::format("imu.{}: {}", field, rule));
}

void validate(const InertialAxesOptions& axes, const std::string& name) {
  const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0; };
  constexpr const char* kRule = "must be a finite number >= 0";
  require(not_negative(axes.noise_density), name + ".noise_density", kRule);
  require(not_negative(axes.random_walk), name + ".random_walk", kRule);
  require(not_negative(axes.range), name + ".range", kRule);
  require(axes.initial_bias.allFinite(), name + ".initial_bias", "must be finite numbers");
  require(axes.scale.allFinite(), name + ".scale", "must be finite numbers");
  require(axes.misalignment.allFinite(), name + ".misalignment", "must be finite numbers");
}

}  // namespace

void validate(const ImuOptions& options) {
  require(options.rate_hz > 0 && options.rate_hz <= kMaxImuRate_hz, "rate_hz",
          "must be above 0 and at most 1e9 Hz, because times are whole nanoseconds");
  require(options.gravity.allFinite(), "gravity", "must be finite numbers");
  validate(options.gyroscope, "gyroscope");
  validate(options.accelerometer, "accelerometer");
}

BiasWalk::BiasWalk(const ImuOptions& options, TimeNs start, std::uint64_t seed)
    : random_(seed, Purpose::imu_bias),
      gyroscope_step_(options.gyroscope.random_walk * std::sqrt(to_seconds(kStep))),
      accelerometer_step_(options.accelerometer.random_walk * std::sqrt(to_seconds(kStep))),
      start_(start),
      steps_{{options.gyroscope.initial_bias, options.accelerometer.initial_bias}} {}

InertialSignals BiasWalk::at(TimeNs t) {
  if (t < start_) throw InternalError(fmt::format("imu: time {} ns is before the start at {} ns", t, start_));
  const auto step = static_cast<std::size_t>((t - start_) / kStep);
  const double u = static_cast<double>((t - start_) % kStep) / static_cast<double>(kStep);
  walk_to(step + 2);
  const auto between = [&](auto signal) {
    const Eigen::Vector3d &a = steps_[step].*signal, &b = steps_[step + 1].*signal;
    const Eigen::Vector3d before = step > 0 ? steps_[step - 1].*signal : Eigen::Vector3d(2 * a - b);
    return catmull_rom(before, a, b, steps_[step + 2].*signal, u);
  };
  return {between(&InertialSignals::angular_rate), between(&InertialSignals::specific_force)};
}

void BiasWalk::walk_to(std::size_t step) {
  while (steps_.size() <= step) {
    const InertialSignals deviates = normals(random_, steps_.size());
    const InertialSignals& last = steps_.back();
    steps_.push_back({last.angular_rate + gyroscope_step_ * deviates.angular_rate,
                      last.specific_force + accelerometer_step_ * deviates.specific_force});
  }
}

Imu::Imu(const ImuOptions& options, TimeNs start, std::uint64_t seed)
    : options_((validate(options), options)),
      start_(start),
      noise_(seed, Purpose::imu_noise),
      walk_(options, start, seed) {}

InertialSignals Imu::measure(TimeNs t, const InertialSignals& truth) {
  const InertialSignals bias = walk_.at(t);
  const InertialSignals deviates =
      normals(noise_, static_cast<std::uint64_t>(std::llround(to_seconds(t - start_) * options_.rate_hz)));
  return {
      measure_axes(options_.gyroscope, truth.angular_rate, bias.angular_rate, deviates.angular_rate, options_.rate_hz),
      measure_axes(options_.accelerometer, truth.specific_force, bias.specific_force, deviates.specific_force,
                   options_.rate_hz)};
}

}  // namespace esim::inline imu
