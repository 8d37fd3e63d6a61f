#include "esim/geometry/bspline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"

namespace esim::inline geometry {

namespace {

double binomial(int n, int k) {
  double value = 1.0;
  for (int i = 1; i <= k; ++i) value = value * (n - k + i) / i;
  return value;
}

// Entry (s, n) of the uniform blending matrix M(k): the coefficient of u^n in the weight of control point s,
//   C(k−1, n)/(k−1)! Σ_{l=s}^{k−1} (−1)^{l−s} C(k, l−s) (k−1−l)^{k−1−n}    (Sommer et al., section 3.2).
double blending_coefficient(int order, int s, int n) {
  double sum = 0.0;
  for (int l = s; l < order; ++l) {
    const double sign = (l - s) % 2 == 0 ? 1.0 : -1.0;
    sum += sign * binomial(order, l - s) * std::pow(order - 1 - l, order - 1 - n);
  }
  return binomial(order - 1, n) / std::tgamma(order) * sum;
}

}  // namespace

RotationValue cumulative_rotation(const Eigen::Quaterniond& first, std::span<const Eigen::Vector3d> increments,
                                  const BasisWeights& lambda) {
  RotationValue result{first, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (std::size_t j = 1; j <= increments.size(); ++j) {
    const Eigen::Vector3d& increment = increments[j - 1];
    const Eigen::Quaterniond factor = so3_exp(lambda.value[j] * increment);
    const Eigen::Quaterniond back = factor.conjugate();
    result.rotation = result.rotation * factor;
    result.angular_velocity = back * result.angular_velocity + lambda.first_derivative[j] * increment;
    result.angular_acceleration = back * result.angular_acceleration +
                                  lambda.first_derivative[j] * result.angular_velocity.cross(increment) +
                                  lambda.second_derivative[j] * increment;
  }
  result.rotation.normalize();
  return result;
}

UniformBasis::UniformBasis(int order, double start_s, double knot_interval_s, int control_points)
    : order_(order), start_s_(start_s), knot_interval_s_(knot_interval_s), control_points_(control_points) {
  if (order < kMinSplineOrder || order > kMaxSplineOrder) {
    throw InternalError(fmt::format("spline order {} is not in {}..{}", order, kMinSplineOrder, kMaxSplineOrder));
  }
  if (control_points < order) {
    throw InternalError(
        fmt::format("a spline of order {} needs at least {} control points, not {}", order, order, control_points));
  }
  if (!std::isfinite(start_s)) throw InternalError(fmt::format("spline start {} s is not finite", start_s));
  if (!(knot_interval_s > 0.0) || !std::isfinite(knot_interval_s)) {
    throw InternalError(fmt::format("knot interval {} s is not positive and finite", knot_interval_s));
  }
  // A cumulative weight is the sum of its own weight and all later ones.
  for (int s = order - 1; s >= 0; --s) {
    for (int n = 0; n < order; ++n) {
      polynomials_[s][n] = blending_coefficient(order, s, n);
      cumulative_polynomials_[s][n] = polynomials_[s][n] + (s + 1 < order ? cumulative_polynomials_[s + 1][n] : 0.0);
    }
  }
}

double UniformBasis::centre_s(int control_point) const {
  return start_s_ + (control_point + 1 - 0.5 * order_) * knot_interval_s_;
}

BasisWeights UniformBasis::evaluate(double t_s, const Polynomials& polynomials) const {
  const double slack = 1e-9 * (end_s() - start_s_);
  if (!(t_s >= start_s_ - slack && t_s <= end_s() + slack)) {
    throw InternalError(
        fmt::format("time {:.9f} s is outside the spline's [{:.9f}, {:.9f}] s", t_s, start_s_, end_s()));
  }
  // Segment, and position u in it; the end of the spline belongs to the last segment.
  const double position = std::clamp((t_s - start_s_) / knot_interval_s_, 0.0, static_cast<double>(segments()));
  BasisWeights weights;
  weights.first = std::min(static_cast<int>(position), segments() - 1);
  const double u = position - weights.first;

  // Horner's scheme for each weight and its two derivatives.
  for (int j = 0; j < order_; ++j) {
    double value = 0.0, slope = 0.0, half_curvature = 0.0;
    for (int n = order_ - 1; n >= 0; --n) {
      half_curvature = half_curvature * u + slope;
      slope = slope * u + value;
      value = value * u + polynomials[j][n];
    }
    weights.value[j] = value;
    weights.first_derivative[j] = slope / knot_interval_s_;
    weights.second_derivative[j] = 2.0 * half_curvature / (knot_interval_s_ * knot_interval_s_);
  }
  return weights;
}

So3Spline::So3Spline(const UniformBasis& basis, std::vector<Eigen::Quaterniond> rotations)
    : basis_(basis), rotations_(std::move(rotations)) {
  if (static_cast<int>(rotations_.size()) != basis.control_points()) {
    throw InternalError(
        fmt::format("spline has {} control rotations, expected {}", rotations_.size(), basis.control_points()));
  }
  for (std::size_t j = 0; j < rotations_.size(); ++j) {
    const double norm = rotations_[j].norm();
    if (!(norm > 0.0) || !std::isfinite(norm)) {
      throw InternalError(fmt::format("control rotation {} has norm {}", j, norm));
    }
    rotations_[j].normalize();
  }
  for (std::size_t j = 1; j < rotations_.size(); ++j) {
    increments_.push_back(so3_log(rotations_[j - 1].conjugate() * rotations_[j]));
  }
}

RotationValue So3Spline::at(double t_s) const {
  const BasisWeights lambda = basis_.cumulative_weights(t_s);
  const auto first = static_cast<std::size_t>(lambda.first), count = static_cast<std::size_t>(basis_.order() - 1);
  return cumulative_rotation(rotations_[first], std::span(increments_).subspan(first, count), lambda);
}

RotationSensitivity So3Spline::sensitivity(double t_s) const {
  const BasisWeights lambda = basis_.cumulative_weights(t_s);
  RotationSensitivity result;
  result.first = lambda.first;
  result.jacobian.fill(Eigen::Matrix3d::Zero());

  // From the last factor to the first, where `tail` is the product of the factors after the current one. A change x of
  // increment j rotates its factor by Jr(λ_j d_j) λ_j x, and the change of the increment is
  // Jr⁻¹(d_j) ε_j − Jl⁻¹(d_j) ε_{j−1}.
  Eigen::Quaterniond tail = Eigen::Quaterniond::Identity();
  for (int j = basis_.order() - 1; j >= 1; --j) {
    const Eigen::Vector3d& increment = increments_[lambda.first + j - 1];
    const Eigen::Vector3d partial = lambda.value[j] * increment;
    const Eigen::Matrix3d turn = tail.conjugate().toRotationMatrix() * so3_right_jacobian(partial) * lambda.value[j];
    result.jacobian[j] += turn * so3_right_jacobian_inverse(increment);
    result.jacobian[j - 1] -= turn * so3_left_jacobian_inverse(increment);
    tail = so3_exp(partial) * tail;
  }
  result.jacobian[0] += tail.conjugate().toRotationMatrix();
  result.rotation = (rotations_[lambda.first] * tail).normalized();
  return result;
}

Se3Spline::Se3Spline(int order, double start_s, double knot_interval_s, std::vector<Eigen::Quaterniond> rotations,
                     std::vector<Eigen::Vector3d> positions)
    : rotation_(UniformBasis(order, start_s, knot_interval_s, static_cast<int>(positions.size())),
                std::move(rotations)),
      positions_(std::move(positions)) {
  for (std::size_t j = 0; j < positions_.size(); ++j) {
    if (!positions_[j].allFinite()) throw InternalError(fmt::format("control position {} is not finite", j));
  }
}

SplineValue Se3Spline::at(double t_s) const {
  const RotationValue rotation = rotation_.at(t_s);
  const BasisWeights weights = basis().weights(t_s);
  SplineValue result{{rotation.rotation, Eigen::Vector3d::Zero()},
                     Eigen::Vector3d::Zero(),
                     Eigen::Vector3d::Zero(),
                     rotation.angular_velocity,
                     rotation.angular_acceleration};
  for (int j = 0; j < basis().order(); ++j) {
    const Eigen::Vector3d& position = positions_[weights.first + j];
    result.pose.translation += weights.value[j] * position;
    result.velocity += weights.first_derivative[j] * position;
    result.acceleration += weights.second_derivative[j] * position;
  }
  return result;
}

}  // namespace esim::inline geometry
