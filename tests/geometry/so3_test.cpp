#include "esim/geometry/so3.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::largest_difference;
using test::numeric_jacobian;

const Vector3d kAxis = Vector3d(0.3, -0.8, 0.52).normalized();

std::vector<double> angles_up_to(double largest) {
  std::vector<double> angles{0.0,      1e-300,   1e-160, 1e-20, 1e-12, 1e-8, 1e-6, 0.999e-3,
                             1.001e-3, 2.001e-3, 0.01,   0.1,   1.0,   2.0,  3.0};
  for (const double before : {1e-3, 1e-6, 1e-9, 1e-12}) angles.push_back(largest - before);
  return angles;
}

TEST(So3, HatIsTheCrossProduct) {
  const Vector3d v(1.0, -2.0, 3.0), w(0.4, 0.5, -0.6);
  EXPECT_LT(largest_difference(hat(v) * w, v.cross(w)), 1e-15);
}

TEST(So3, ExpIsRotationAboutTheAxis) {
  for (const double angle : {1e-300, 1e-9, 0.5e-3, 0.1, 1.0, 3.0, 3.5, 6.0, 7.0, 100.0}) {
    const Quaterniond q = so3_exp(angle * kAxis);
    EXPECT_NEAR(q.norm(), 1.0, 1e-15);
    const Matrix3d expected = Eigen::AngleAxisd(angle, kAxis).toRotationMatrix();
    EXPECT_LT(largest_difference(q.toRotationMatrix(), expected), 1e-15 * (3.0 + angle)) << angle;
  }
}

TEST(So3, LogInvertsExpToRelativePrecisionUpToPi) {
  for (const double angle : angles_up_to(std::numbers::pi)) {
    const Vector3d v = angle * kAxis;
    EXPECT_LT((so3_log(so3_exp(v)) - v).stableNorm(), 2e-15 * angle + 1e-310) << angle;
  }
}

TEST(So3, LogTakesTheShorterWay) {
  for (const double angle : {3.2, 4.0, 6.0, 2.0 * std::numbers::pi - 1e-9}) {
    const Vector3d expected = (angle - 2.0 * std::numbers::pi) * kAxis;
    EXPECT_LT(largest_difference(so3_log(so3_exp(angle * kAxis)), expected), 2e-15) << angle;
  }
  const Quaterniond q = so3_exp(Vector3d(0.3, 2.0, -1.0));
  EXPECT_EQ(so3_log(Quaterniond(-q.coeffs())), so3_log(q));
}

TEST(So3, LogOfHalfATurnHasLengthPi) {
  const Quaterniond half_turn(0.0, kAxis.x(), kAxis.y(), kAxis.z());
  EXPECT_NEAR(so3_log(half_turn).norm(), std::numbers::pi, 1e-15);
  const Quaterniond beyond(-1e-17, kAxis.x(), kAxis.y(), kAxis.z());
  EXPECT_LT(largest_difference(so3_log(beyond), -std::numbers::pi * kAxis), 1e-14);
}

TEST(So3, JacobiansAreTheDerivativesOfExp) {
  for (const double angle : {0.0, 1e-4, 0.9e-3, 1.1e-3, 0.1, 1.0, 3.0, 4.5}) {
    const Vector3d v = angle * kAxis;
    const auto right = [&](const Vector3d& w) -> Vector3d { return so3_log(so3_exp(v).conjugate() * so3_exp(w)); };
    const auto left = [&](const Vector3d& w) -> Vector3d { return so3_log(so3_exp(w) * so3_exp(v).conjugate()); };
    EXPECT_LT(largest_difference(so3_right_jacobian(v), numeric_jacobian(right, v)), 1e-11) << angle;
    EXPECT_LT(largest_difference(so3_left_jacobian(v), numeric_jacobian(left, v)), 1e-11) << angle;
  }
}

TEST(So3, InverseJacobiansAreTheDerivativesOfLog) {
  for (const double angle : {0.0, 1e-4, 0.9e-3, 1.1e-3, 0.1, 1.0, 3.0}) {
    const Vector3d v = angle * kAxis;
    const auto right = [&](const Vector3d& d) -> Vector3d { return so3_log(so3_exp(v) * so3_exp(d)); };
    const auto left = [&](const Vector3d& d) -> Vector3d { return so3_log(so3_exp(d) * so3_exp(v)); };
    const Vector3d zero = Vector3d::Zero();
    EXPECT_LT(largest_difference(so3_right_jacobian_inverse(v), numeric_jacobian(right, zero)), 1e-11) << angle;
    EXPECT_LT(largest_difference(so3_left_jacobian_inverse(v), numeric_jacobian(left, zero)), 1e-11) << angle;
  }
}

TEST(So3, InverseJacobiansAreInversesAtEveryAngle) {
  for (const double angle : angles_up_to(std::numbers::pi)) {
    const Vector3d v = angle * kAxis;
    const Matrix3d identity = Matrix3d::Identity();
    EXPECT_LT(largest_difference(so3_right_jacobian(v) * so3_right_jacobian_inverse(v), identity), 1e-14) << angle;
    EXPECT_LT(largest_difference(so3_left_jacobian(v) * so3_left_jacobian_inverse(v), identity), 1e-14) << angle;
  }
}

TEST(So3, LeftJacobianIsTheRightOneTurned) {
  const Vector3d v(0.4, -1.2, 0.9);
  EXPECT_LT(largest_difference(so3_left_jacobian(v), so3_exp(v).toRotationMatrix() * so3_right_jacobian(v)), 1e-15);
}

}  // namespace
}  // namespace esim
