#include "esim/geometry/bezier.h"

#include "esim/geometry/so3.h"

namespace esim::inline geometry {

namespace {

constexpr int kDegree = 5;

/// C(n, k) u^k (1 − u)^(n − k); zero for k outside 0 … n.
double bernstein(int n, int k, double u) {
  if (k < 0 || k > n) return 0.0;
  double value = 1.0;
  for (int i = 1; i <= k; ++i) value *= u * (n - k + i) / i;
  for (int i = 0; i < n - k; ++i) value *= 1.0 - u;
  return value;
}

/// λ_j = Σ_{k≥j} B_k with λ_j′ = 5 B_{j−1} of degree 4 and λ_j″ = 20 (B_{j−2} − B_{j−1}) of degree 3.
BasisWeights cumulative_bernstein(double u, double duration_s) {
  BasisWeights weights;
  double sum = 0.0;
  for (int j = kDegree; j >= 1; --j) {
    sum += bernstein(kDegree, j, u);
    weights.value[j] = sum;
    weights.first_derivative[j] = kDegree * bernstein(kDegree - 1, j - 1, u) / duration_s;
    weights.second_derivative[j] = kDegree * (kDegree - 1) *
                                   (bernstein(kDegree - 2, j - 2, u) - bernstein(kDegree - 2, j - 1, u)) /
                                   (duration_s * duration_s);
  }
  return weights;
}

}  // namespace

QuinticBezier::QuinticBezier(const SplineValue& start, const SplineValue& end, double duration_s)
    : duration_s_(duration_s), start_(start.pose) {
  // At the ends λ_1′ = λ_5′ = 5/T, λ_1″ = λ_4″ = −20/T² and λ_2″ = λ_5″ = 20/T²; the other derivatives vanish.
  const double per_velocity = duration_s / kDegree;
  const double per_acceleration = duration_s * duration_s / (kDegree * (kDegree - 1));

  auto& c = position_increments_;
  c[0] = per_velocity * start.velocity;
  c[1] = c[0] + per_acceleration * start.acceleration;
  c[4] = per_velocity * end.velocity;
  c[3] = c[4] - per_acceleration * end.acceleration;
  c[2] = end.pose.translation - start.pose.translation - (c[0] + c[1] + c[3] + c[4]);

  // The same in the body frame, where the last factor rotates the earlier ones.
  auto& d = rotation_increments_;
  d[0] = per_velocity * start.angular_velocity;
  d[1] = d[0] + per_acceleration * start.angular_acceleration;
  d[4] = per_velocity * end.angular_velocity;
  d[3] = so3_exp(d[4]) * (d[4] - per_acceleration * end.angular_acceleration);
  const Eigen::Quaterniond before = start.pose.rotation * so3_exp(d[0]) * so3_exp(d[1]);
  const Eigen::Quaterniond after = end.pose.rotation * so3_exp(-d[4]) * so3_exp(-d[3]);
  d[2] = so3_log((before.conjugate() * after).normalized());
}

SplineValue QuinticBezier::at(double t_s) const {
  const BasisWeights lambda = cumulative_bernstein(t_s / duration_s_, duration_s_);
  const RotationValue rotation = cumulative_rotation(start_.rotation, rotation_increments_, lambda);
  SplineValue result{{rotation.rotation, start_.translation},
                     Eigen::Vector3d::Zero(),
                     Eigen::Vector3d::Zero(),
                     rotation.angular_velocity,
                     rotation.angular_acceleration};
  for (std::size_t j = 1; j <= position_increments_.size(); ++j) {
    const Eigen::Vector3d& increment = position_increments_[j - 1];
    result.pose.translation += lambda.value[j] * increment;
    result.velocity += lambda.first_derivative[j] * increment;
    result.acceleration += lambda.second_derivative[j] * increment;
  }
  return result;
}

}  // namespace esim::inline geometry
