#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace esim::inline geometry {

/// The skew-symmetric matrix of the cross product: hat(v) w = v × w.
Eigen::Matrix3d hat(const Eigen::Vector3d& v);

/// Exp: rotation vector (axis times angle, rad) to unit quaternion, (v sin(θ/2)/θ, cos(θ/2)) with θ = |v|.
/// Defined for every finite v, including angles above 2π.
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& v);

/// Log: the rotation vector of the shorter of the two rotations that ±q describe, so |Log(q)| ≤ π.
/// `q` must have unit norm. Accurate near the identity and near π, where the axis changes sign.
Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);

/// Right Jacobian, with θ = |v|:
///   Jr(v) = I − (1 − cos θ)/θ² hat(v) + (θ − sin θ)/θ³ hat(v)²,   Exp(v + δ) = Exp(v) Exp(Jr(v) δ) + O(δ²)
/// (Solà, Deray and Atchuthan, "A micro Lie theory", arXiv:1812.01537, eq. 143).
Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& v);

/// Inverse of the right Jacobian, for θ < 2π:
///   Jr⁻¹(v) = I + hat(v)/2 + (1/θ² − (1 + cos θ)/(2 θ sin θ)) hat(v)²,   Log(Exp(v) Exp(δ)) = v + Jr⁻¹(v) δ + O(δ²)
/// (ibid., eq. 144).
Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& v);

/// Left Jacobian, Jl(v) = Jr(−v):   Exp(v + δ) = Exp(Jl(v) δ) Exp(v) + O(δ²)   (ibid., eq. 145).
Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& v);

/// Inverse of the left Jacobian, for θ < 2π:   Log(Exp(δ) Exp(v)) = v + Jl⁻¹(v) δ + O(δ²)   (ibid., eq. 146).
Eigen::Matrix3d so3_left_jacobian_inverse(const Eigen::Vector3d& v);

}  // namespace esim::inline geometry
