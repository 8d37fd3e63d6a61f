#pragma once

#include <Eigen/Core>

#include "esim/geometry/se3.h"

namespace esim::inline geometry {

/// The motion of a body at one instant. Gravity is not part of the acceleration.
struct Kinematics {
  SE3 T_world_body;
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();      // of the body's origin, m/s
  Eigen::Vector3d acceleration_world = Eigen::Vector3d::Zero();  // of the body's origin, m/s²
  Eigen::Vector3d omega_body = Eigen::Vector3d::Zero();          // angular velocity in the body frame, rad/s
  Eigen::Vector3d alpha_body = Eigen::Vector3d::Zero();          // angular acceleration in the body frame, rad/s²
};

/// Signals of an inertial measurement unit in its own frame: true values, measurements, or biases.
struct InertialSignals {
  Eigen::Vector3d angular_rate = Eigen::Vector3d::Zero();    // rad/s
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();  // acceleration minus gravity, m/s²
};

/// The motion of a frame C (a camera, an IMU) rigidly attached to the body B, with p = T_B_C's translation:
///   v_C = v_B + R_WB (ω × p),   a_C = a_B + R_WB (α × p + ω × (ω × p)),   ω_C = R_BCᵀ ω,   α_C = R_BCᵀ α.
/// The result's "body" is C.
Kinematics rigidly_attached(const Kinematics& body, const SE3& T_body_camera);

}  // namespace esim::inline geometry
