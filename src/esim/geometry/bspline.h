#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "esim/geometry/se3.h"

namespace esim::inline geometry {

inline constexpr int kMinSplineOrder = 2;
inline constexpr int kMaxSplineOrder = 6;

/// Weights of consecutive control points at one instant: entries 0 … order−1 belong to the control points
/// first … first+order−1; the others are zero.
struct BasisWeights {
  using Array = std::array<double, kMaxSplineOrder>;
  int first = 0;
  Array value{};
  Array first_derivative{};   // 1/s
  Array second_derivative{};  // 1/s²
};

/// The uniform B-spline basis of a given order (degree + 1, 2 … 6) over [start_s, end_s]. A spline with n control
/// points has n − order + 1 segments of length knot_interval_s. Blending matrices as in Sommer et al., "Efficient
/// Derivative Computation for Cumulative B-Splines on Lie Groups", CVPR 2020 (arXiv:1911.08860), section 3.
class UniformBasis {
 public:
  /// Throws InternalError for an order out of range, fewer control points than the order, a knot interval that is
  /// not positive and finite, or a start that is not finite.
  UniformBasis(int order, double start_s, double knot_interval_s, int control_points);

  int order() const { return order_; }
  double start_s() const { return start_s_; }
  double end_s() const { return start_s_ + segments() * knot_interval_s_; }
  double knot_interval_s() const { return knot_interval_s_; }
  int control_points() const { return control_points_; }
  int segments() const { return control_points_ - order_ + 1; }

  /// Weights of the control points themselves: p(t) = Σ value[j] p[first + j]; the values sum to 1.
  /// Throws InternalError if t is outside [start_s, end_s] by more than 1e-9 of the duration.
  BasisWeights weights(double t_s) const { return evaluate(t_s, polynomials_); }

  /// Weights of the differences: p(t) = p[first] + Σ_{j≥1} value[j] (p[first + j] − p[first + j − 1]).
  BasisWeights cumulative_weights(double t_s) const { return evaluate(t_s, cumulative_polynomials_); }

  /// The middle of the support of a control point, where its weight is largest. For the first and last few control
  /// points it is outside [start_s, end_s].
  double centre_s(int control_point) const;

 private:
  // Row j holds the coefficients of weight j in powers of u, the position in the segment from 0 to 1.
  using Polynomials = std::array<BasisWeights::Array, kMaxSplineOrder>;

  BasisWeights evaluate(double t_s, const Polynomials& polynomials) const;

  int order_;
  double start_s_;
  double knot_interval_s_;
  int control_points_;
  Polynomials polynomials_{};
  Polynomials cumulative_polynomials_{};
};

/// Orientation with its derivatives in the body frame.
struct RotationValue {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d angular_velocity;      // rad/s
  Eigen::Vector3d angular_acceleration;  // rad/s²
};

/// R = first ∏_{j≥1} Exp(λ_j d_j) with its derivatives, where d_j = increments[j − 1] and λ are cumulative weights,
/// which are functions of time: the recurrences of Sommer et al., section 4, linear in the number of increments.
RotationValue cumulative_rotation(const Eigen::Quaterniond& first, std::span<const Eigen::Vector3d> increments,
                                  const BasisWeights& lambda);

/// Sensitivity of an orientation to its control rotations: with R[first + j] replaced by R[first + j] Exp(ε_j),
/// R(t) becomes R(t) Exp(Σ jacobian[j] ε_j + O(ε²)).
struct RotationSensitivity {
  Eigen::Quaterniond rotation;
  int first = 0;
  std::array<Eigen::Matrix3d, kMaxSplineOrder> jacobian;  // of the first `order` entries
};

/// Cumulative B-spline on SO(3), Sommer et al., section 3.3: with d_j = Log(R[i+j−1]⁻¹ R[i+j]),
///   R(t) = R[i] ∏_{j=1}^{order−1} Exp(λ_j(t) d_j).
/// The increments d_j are the shorter rotations, |d_j| ≤ π.
class So3Spline {
 public:
  /// Throws InternalError if the number of rotations differs from that of the basis, or if one is zero or not finite.
  So3Spline(const UniformBasis& basis, std::vector<Eigen::Quaterniond> rotations);

  const UniformBasis& basis() const { return basis_; }
  const std::vector<Eigen::Quaterniond>& rotations() const { return rotations_; }

  /// increments()[j] = Log(R[j]⁻¹ R[j+1]).
  const std::vector<Eigen::Vector3d>& increments() const { return increments_; }

  RotationValue at(double t_s) const;

  RotationSensitivity sensitivity(double t_s) const;

 private:
  UniformBasis basis_;
  std::vector<Eigen::Quaterniond> rotations_;
  std::vector<Eigen::Vector3d> increments_;
};

struct SplineValue {
  SE3 pose;                              // T_world_body
  Eigen::Vector3d velocity;              // of the body's origin in the world frame, m/s
  Eigen::Vector3d acceleration;          // of the body's origin in the world frame, m/s²
  Eigen::Vector3d angular_velocity;      // in the body frame, rad/s
  Eigen::Vector3d angular_acceleration;  // in the body frame, rad/s²
};

/// Uniform B-spline on SO(3)×R³. The motion has order − 2 continuous derivatives. Evaluation is thread-safe.
class Se3Spline {
 public:
  /// One rotation and one position per control point, at least `order` of them. Throws InternalError otherwise.
  Se3Spline(int order, double start_s, double knot_interval_s, std::vector<Eigen::Quaterniond> rotations,
            std::vector<Eigen::Vector3d> positions);

  /// Throws InternalError if t is outside [start_s, end_s] by more than 1e-9 of the duration.
  SplineValue at(double t_s) const;

  const UniformBasis& basis() const { return rotation_.basis(); }
  double start_s() const { return basis().start_s(); }
  double end_s() const { return basis().end_s(); }
  const std::vector<Eigen::Quaterniond>& rotations() const { return rotation_.rotations(); }
  const std::vector<Eigen::Vector3d>& positions() const { return positions_; }

 private:
  So3Spline rotation_;
  std::vector<Eigen::Vector3d> positions_;
};

}  // namespace esim::inline geometry
