#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "esim/geometry/bspline.h"

namespace esim::inline geometry {

/// A quintic Bézier curve on SO(3)×R³, over [0, duration_s]: with λ_j the cumulative Bernstein polynomials of degree 5,
///   p(t) = p_0 + Σ_{j=1}^5 λ_j(t) c_j,   R(t) = R_0 ∏_{j=1}^5 Exp(λ_j(t) d_j)
/// (Kim, Kim and Shin, "A General Construction Scheme for Unit Quaternion Curves with Simple High Order Derivatives",
/// SIGGRAPH 1995). Curves with the same pose, velocities and accelerations at a joint form a motion with two continuous
/// derivatives.
class QuinticBezier {
 public:
  /// The curve with these poses, velocities and accelerations at its ends. The duration must be positive. If the
  /// velocities at the ends are moderate, the body makes the shorter rotation.
  QuinticBezier(const SplineValue& start, const SplineValue& end, double duration_s);

  /// For t in [0, duration_s].
  SplineValue at(double t_s) const;

  double duration_s() const { return duration_s_; }

 private:
  double duration_s_;
  SE3 start_;
  std::array<Eigen::Vector3d, 5> position_increments_;
  std::array<Eigen::Vector3d, 5> rotation_increments_;
};

}  // namespace esim::inline geometry
