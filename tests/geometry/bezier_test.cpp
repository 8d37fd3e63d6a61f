#include "esim/geometry/bezier.h"

#include <gtest/gtest.h>

#include "esim/geometry/so3.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Vector3d;
using test::largest_difference;
using test::numeric_derivative;

SplineValue state(const Vector3d& turn, const Vector3d& position, double scale) {
  return {{so3_exp(turn), position},
          scale * Vector3d(0.4, -1.0, 0.3),
          scale * Vector3d(-2.0, 0.5, 1.5),
          scale * Vector3d(0.9, 0.2, -0.7),
          scale * Vector3d(0.6, -1.1, 2.0)};
}

void expect_equal(const SplineValue& a, const SplineValue& b, double tolerance) {
  EXPECT_LT(largest_difference(a.pose.translation, b.pose.translation), tolerance);
  EXPECT_LT(a.pose.rotation.angularDistance(b.pose.rotation), tolerance);
  EXPECT_LT(largest_difference(a.velocity, b.velocity), tolerance);
  EXPECT_LT(largest_difference(a.acceleration, b.acceleration), tolerance);
  EXPECT_LT(largest_difference(a.angular_velocity, b.angular_velocity), tolerance);
  EXPECT_LT(largest_difference(a.angular_acceleration, b.angular_acceleration), tolerance);
}

TEST(QuinticBezier, HasTheStatesOfItsEnds) {
  const SplineValue start = state({0.3, -0.2, 1.0}, {1, 2, 3}, 1.0), end = state({-0.5, 0.9, 0.4}, {-1, 0, 4}, -1.4);
  for (const double duration_s : {0.01, 0.7, 3.0}) {
    const QuinticBezier curve(start, end, duration_s);
    expect_equal(curve.at(0), start, 1e-10);
    expect_equal(curve.at(duration_s), end, 1e-10);
  }
}

TEST(QuinticBezier, DerivativesAreThoseOfThePose) {
  const QuinticBezier curve(state({0.3, -0.2, 1.0}, {1, 2, 3}, 1.0), state({-0.5, 0.9, 0.4}, {-1, 0, 4}, -1.4), 0.8);
  for (const double t : {0.05, 0.31, 0.4, 0.62, 0.77}) {
    const SplineValue here = curve.at(t);
    const auto position = [&](double s) -> Vector3d { return curve.at(s).pose.translation; };
    const auto velocity = [&](double s) -> Vector3d { return curve.at(s).velocity; };
    const auto turned = [&](double s) -> Vector3d {
      return so3_log(here.pose.rotation.conjugate() * curve.at(s).pose.rotation);
    };
    const auto rate = [&](double s) -> Vector3d { return curve.at(s).angular_velocity; };
    EXPECT_LT(largest_difference(here.velocity, numeric_derivative(position, t)), 1e-8) << t;
    EXPECT_LT(largest_difference(here.acceleration, numeric_derivative(velocity, t)), 1e-7) << t;
    EXPECT_LT(largest_difference(here.angular_velocity, numeric_derivative(turned, t)), 1e-8) << t;
    EXPECT_LT(largest_difference(here.angular_acceleration, numeric_derivative(rate, t)), 1e-7) << t;
  }
}

TEST(QuinticBezier, ReproducesConstantMotion) {
  const Vector3d velocity(0.3, -0.1, 2.0), rate(0.4, 0.8, -0.2);
  const SE3 pose{so3_exp({0.1, 0.2, 0.3}), {1, 1, 1}};
  const auto moved = [&](double t) {
    return SplineValue{{pose.rotation * so3_exp(t * rate), pose.translation + t * velocity},
                       velocity,
                       Vector3d::Zero(),
                       rate,
                       Vector3d::Zero()};
  };
  const QuinticBezier curve(moved(0), moved(1.5), 1.5);
  for (const double t : {0.2, 0.9, 1.3}) expect_equal(curve.at(t), moved(t), 1e-12);
}

}  // namespace
}  // namespace esim
