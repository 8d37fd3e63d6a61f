#include "esim/geometry/so3.h"

#include <cmath>

namespace esim::inline geometry {

namespace {

// Below this angle the first terms of the power series are exact to double precision.
constexpr double kSmallAngle = 1e-3;

}  // namespace

Eigen::Matrix3d hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& v) {
  const double angle = v.stableNorm();
  const double half_sinc =
      angle < kSmallAngle ? 0.5 - angle * angle / 48.0 * (1.0 - angle * angle / 80.0) : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = half_sinc * v;
  return q;
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const double cosine = sign * q.w();
  const double sine = q.vec().stableNorm();
  if (sine < kSmallAngle) {
    // atan(s/c)/s = 1/c − s²/(3 c³) + s⁴/(5 c⁵) − …
    const double ratio = sine * sine / (cosine * cosine);
    return sign * 2.0 / cosine * (1.0 - ratio / 3.0 + ratio * ratio / 5.0) * q.vec();
  }
  return sign * 2.0 * std::atan2(sine, cosine) / sine * q.vec();
}

Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  const double squared = angle * angle;
  const bool small = angle < kSmallAngle;
  const double half_sine = std::sin(0.5 * angle);  // 1 − cos θ = 2 sin²(θ/2), without cancellation
  const double first = small ? 0.5 - squared / 24.0 : 2.0 * half_sine * half_sine / squared;
  const double second = small ? 1.0 / 6.0 - squared / 120.0 : (angle - std::sin(angle)) / (squared * angle);
  const Eigen::Matrix3d cross = hat(v);
  return Eigen::Matrix3d::Identity() - first * cross + second * cross * cross;
}

Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  const double squared = angle * angle;
  // (1 + cos θ)/sin θ = cot(θ/2), which stays finite at π.
  const double second =
      angle < kSmallAngle ? 1.0 / 12.0 + squared / 720.0 : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / squared;
  const Eigen::Matrix3d cross = hat(v);
  return Eigen::Matrix3d::Identity() + 0.5 * cross + second * cross * cross;
}

Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& v) { return so3_right_jacobian(-v); }

Eigen::Matrix3d so3_left_jacobian_inverse(const Eigen::Vector3d& v) { return so3_right_jacobian_inverse(-v); }

}  // namespace esim::inline geometry
