#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/geometry/kinematics.h"
#include "esim/imu/options.h"

namespace esim::inline imu {

/// The random walks of an IMU's biases as functions of time, evaluated at any times after the start and in any order.
/// Keeps the steps that it has drawn.
class BiasWalk {
 public:
  static constexpr TimeNs kStep = 5 * kNsPerMs;

  BiasWalk(const ImuOptions& options, TimeNs start, std::uint64_t seed);

  /// Between two steps: cubic interpolation with Catmull-Rom slopes, continuous with its derivative.
  InertialSignals at(TimeNs t);

 private:
  void walk_to(std::size_t step);

  AddressedRandom random_;
  double gyroscope_step_, accelerometer_step_;  // standard deviations
  TimeNs start_;
  std::vector<InertialSignals> steps_;
};

/// An inertial measurement unit: converts the true motion to measurements. A measurement is a pure function of
/// (options, seed, time since the start, truth), with independent noise at each of the times k / rate_hz.
class Imu {
 public:
  /// Throws UserError naming an option that is out of range.
  Imu(const ImuOptions& options, TimeNs start, std::uint64_t seed);

  /// Throws InternalError for times before the start.
  InertialSignals measure(TimeNs t, const InertialSignals& truth);

  InertialSignals bias(TimeNs t) { return walk_.at(t); }

  const ImuOptions& options() const { return options_; }

 private:
  ImuOptions options_;
  TimeNs start_;
  AddressedRandom noise_;
  BiasWalk walk_;
};

}  // namespace esim::inline imu
