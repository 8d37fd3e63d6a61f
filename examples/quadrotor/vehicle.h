#pragma once

#include <esim/geometry/se3.h>

/// A command of the pilot.
struct Command {
  double thrust = 9.81;                             ///< along the body's z axis, per mass, m/s²
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  ///< angular rate in the body frame, rad/s
};

/// A quadrotor whose motors and rate controller follow commands with first-order lags, with linear drag. Body frame:
/// x forwards, y to the left, z up.
class Vehicle {
 public:
  explicit Vehicle(const esim::SE3& T_world_body) : T_world_body_(T_world_body) {}

  void step(const Command& command, double duration_s);

  const esim::SE3& pose() const { return T_world_body_; }

 private:
  esim::SE3 T_world_body_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // world frame, m/s
  Command state_;                                       // the current output of the motors
};
