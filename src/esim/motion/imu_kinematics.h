#pragma once

#include <Eigen/Core>

#include "esim/geometry/kinematics.h"

namespace esim::inline motion {

/// The signals of an ideal inertial measurement unit, with frame I rigidly attached to the body B at T_B_I = (R_BI, p):
///   ω_I = R_BIᵀ ω,   f_I = R_WIᵀ (a_B + R_WB (α × p + ω × (ω × p)) − g),
/// where g = `gravity_world` is the acceleration of free fall in the world frame, m/s². At rest f is −g, upwards.
InertialSignals inertial_signals(const Kinematics& body, const SE3& T_body_imu, const Eigen::Vector3d& gravity_world);

}  // namespace esim::inline motion
