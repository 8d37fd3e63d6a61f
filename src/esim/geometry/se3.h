#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace esim::inline geometry {

/// A rigid transform. An SE3 named T_A_B maps points from frame B to frame A: p_A = rotation p_B + translation,
/// so that T_A_C = T_A_B * T_B_C.
struct SE3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit norm
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();         // m

  SE3 inverse() const;
  SE3 operator*(const SE3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }

  /// The homogeneous 4×4 matrix [R t; 0 0 0 1].
  Eigen::Matrix4d matrix() const;

  /// Converts a homogeneous matrix. The rotation may have rounding errors (RᵀR within 1e-3 of the identity) and is
  /// replaced by the nearest rotation. Throws UserError for larger errors, reflections, and a wrong last row.
  static SE3 from_matrix(const Eigen::Matrix4d& matrix);
};

}  // namespace esim::inline geometry
