#include "vehicle.h"

#include <esim/geometry/so3.h>

#include <cmath>

void Vehicle::step(const Command& command, double duration_s) {
  constexpr double kMotorLag_s = 0.03, kRateLag_s = 0.02, kDrag_per_s = 0.15, kGravity = 9.81;
  state_.thrust += (command.thrust - state_.thrust) * (1 - std::exp(-duration_s / kMotorLag_s));
  state_.omega += (command.omega - state_.omega) * (1 - std::exp(-duration_s / kRateLag_s));

  const Eigen::Vector3d up = T_world_body_.rotation * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d acceleration =
      state_.thrust * up - kGravity * Eigen::Vector3d::UnitZ() - kDrag_per_s * velocity_;
  T_world_body_.translation += duration_s * velocity_ + duration_s * duration_s / 2 * acceleration;
  velocity_ += duration_s * acceleration;
  T_world_body_.rotation = (T_world_body_.rotation * esim::so3_exp(duration_s * state_.omega)).normalized();
}
