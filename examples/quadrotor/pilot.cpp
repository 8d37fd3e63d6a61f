#include "pilot.h"

#include <esim/geometry/so3.h>

#include <cmath>

Waypoint figure_eight(const Eigen::Vector3d& centre, double t_s) {
  // The phase speeds up smoothly: its rate is w (1 − (1 + t/T) exp(−t/T)).
  constexpr double kPeriod_s = 6, kStart_s = 0.7, kHalfLength_m = 2, kHalfWidth_m = 1;
  const double w = 2 * M_PI / kPeriod_s, x = t_s / kStart_s, decay = std::exp(-x);
  const double phase = w * (t_s - 2 * kStart_s + (t_s + 2 * kStart_s) * decay);
  const double rate = w * (1 - (1 + x) * decay), change = w / kStart_s * x * decay;

  const auto wave = [&](double amplitude, double k) {
    const double s = amplitude * std::sin(k * phase), c = amplitude * k * std::cos(k * phase);
    return Eigen::Vector3d(s, c * rate, c * change - k * k * s * rate * rate);
  };
  const Eigen::Vector3d along = wave(kHalfLength_m, 1), across = wave(kHalfWidth_m, 2);
  return {centre + Eigen::Vector3d(along[0], across[0], 0), {along[1], across[1], 0}, {along[2], across[2], 0}};
}

Command steer(const Waypoint& goal, const Estimator& estimate) {
  constexpr double kPosition_per_s2 = 6, kVelocity_per_s = 4, kAttitude_per_s = 10, kLargestRate = 8, kGravity = 9.81;
  const Eigen::Quaterniond& R = estimate.pose().rotation;
  const Eigen::Vector3d wanted = goal.acceleration + kGravity * Eigen::Vector3d::UnitZ() +
                                 kPosition_per_s2 * (goal.position - estimate.pose().translation) +
                                 kVelocity_per_s * (goal.velocity - estimate.velocity());

  Eigen::Matrix3d attitude;
  const Eigen::Vector3d z = wanted.normalized(), y = z.cross(Eigen::Vector3d::UnitX()).normalized();
  attitude << y.cross(z), y, z;
  const Eigen::Vector3d turn = esim::so3_log((R.conjugate() * Eigen::Quaterniond(attitude)).normalized());
  const Eigen::Vector3d omega = kAttitude_per_s * turn;
  return {wanted.dot(R * Eigen::Vector3d::UnitZ()), omega.cwiseMax(-kLargestRate).cwiseMin(kLargestRate)};
}
