#pragma once

#include <Eigen/Core>

#include "esim/core/describe.h"

namespace esim::inline imu {

/// The three axes of a gyroscope or of an accelerometer. From the true signal x, sampled at `rate_hz`, they measure
///   y = M x + b + n,   clipped to ± range.
/// M has the diagonal `scale` and the off-diagonal elements `misalignment`. n is white noise of standard deviation
/// noise_density sqrt(rate_hz). b is a bias that starts at `initial_bias` and follows a random walk, whose variance
/// grows by random_walk² per second. The random walk is drawn at 200 Hz and interpolated by a cubic spline.
struct InertialAxesOptions {
  double noise_density = 0.0;
  double random_walk = 0.0;
  Eigen::Vector3d initial_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Eigen::Matrix<double, 6, 1> misalignment = Eigen::Matrix<double, 6, 1>::Zero();  ///< M's xy xz yx yz zx zy
  double range = 0.0;                                                              ///< 0: unlimited
};

/// In rad/s. The defaults are the noise of the original ESIM.
struct GyroscopeOptions : InertialAxesOptions {
  GyroscopeOptions() : InertialAxesOptions{.noise_density = 1.86e-4, .random_walk = 2.66e-5} {}
};

/// In m/s². The defaults are the noise of the original ESIM.
struct AccelerometerOptions : InertialAxesOptions {
  AccelerometerOptions() : InertialAxesOptions{.noise_density = 1.86e-3, .random_walk = 4.33e-4} {}
};

/// An inertial measurement unit.
struct ImuOptions {
  double rate_hz = 1000.0;
  GyroscopeOptions gyroscope{};
  AccelerometerOptions accelerometer{};
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};
};

/// Maximum rate, because times are whole nanoseconds.
inline constexpr double kMaxImuRate_hz = 1e9;

/// Throws UserError naming the option that is out of range, as in a scenario.
void validate(const ImuOptions& options);

struct InertialUnits {
  const char *signal, *noise_density, *random_walk;
};

template <class Visitor>
void describe_axes(Visitor& visit, InertialAxesOptions& o, const InertialUnits& units) {
  visit("noise_density", o.noise_density, About{"white noise, continuous-time", units.noise_density, 0, 1e6});
  visit("random_walk", o.random_walk, About{"random walk of the bias, continuous-time", units.random_walk, 0, 1e6});
  visit("initial_bias", o.initial_bias, About{"bias at the start", units.signal, -1e6, 1e6});
  visit("scale", o.scale, About{"scale factor of each axis", "", -1e3, 1e3});
  visit("misalignment", o.misalignment,
        About{"cross-axis factors: x from y, x from z, y from x, y from z, z from x, z from y", "", -1e3, 1e3});
  visit("range", o.range, About{"maximum magnitude of an axis; 0: unlimited", units.signal, 0, 1e9});
}

template <class Visitor>
void describe(Visitor& visit, GyroscopeOptions& o) {
  describe_axes(visit, o, {"rad/s", "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"});
}

template <class Visitor>
void describe(Visitor& visit, AccelerometerOptions& o) {
  describe_axes(visit, o, {"m/s^2", "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"});
}

template <class Visitor>
void describe(Visitor& visit, ImuOptions& o) {
  visit("rate_hz", o.rate_hz, About{"measurements per second", "Hz", 0, kMaxImuRate_hz, true});
  visit("gyroscope", o.gyroscope, About{"angular rate"});
  visit("accelerometer", o.accelerometer, About{"specific force"});
  visit("gravity", o.gravity, About{"gravitational acceleration, world frame", "m/s^2", -1e6, 1e6});
}

}  // namespace esim::inline imu
