#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "esim/geometry/bspline.h"

namespace esim::inline motion {

/// weight · Σ_j |difference, of this order, of the control points j, j+1, …|².
struct SmoothnessPenalty {
  int difference_order = 3;  // 2 or 3
  double weight = 0.0;
};

/// Control positions that minimise Σ_i |positions[i] − p(times_s[i])|² + penalty. Throws UserError if the data and the
/// penalty do not determine every control point.
std::vector<Eigen::Vector3d> fit_control_positions(const UniformBasis& basis, std::span<const double> times_s,
                                                   std::span<const Eigen::Vector3d> positions,
                                                   const SmoothnessPenalty& penalty);

/// Control rotations that minimise Σ_i |Log(R(times_s[i])⁻¹ rotations[i])|² + penalty, where the difference of order n
/// of rotations R_j is that of order n − 1 of Log(R_j⁻¹ R_{j+1}). `initial` has one rotation per control point. Throws
/// UserError if a control point is undetermined or no minimum is found.
std::vector<Eigen::Quaterniond> fit_control_rotations(const UniformBasis& basis, std::span<const double> times_s,
                                                      std::span<const Eigen::Quaterniond> rotations,
                                                      const SmoothnessPenalty& penalty,
                                                      std::vector<Eigen::Quaterniond> initial);

}  // namespace esim::inline motion
