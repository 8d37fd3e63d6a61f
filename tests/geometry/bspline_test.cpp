#include "esim/geometry/bspline.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::contains;
using test::largest_difference;
using test::numeric_derivative;
using test::numeric_jacobian;

constexpr double kStart_s = 12.5;
constexpr double kInterval_s = 0.25;
constexpr int kSegments = 5;

struct Controls {
  std::vector<Quaterniond> rotations;
  std::vector<Vector3d> positions;
};

Controls random_controls(int count) {
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Controls controls;
  for (int j = 0; j < count; ++j) {
    const Vector3d turn(uniform(engine), uniform(engine), uniform(engine));
    const Quaterniond before = j == 0 ? Quaterniond::Identity() : controls.rotations.back();
    controls.rotations.push_back(before * so3_exp(1.5 * turn));
    controls.positions.emplace_back(uniform(engine), uniform(engine), uniform(engine));
  }
  return controls;
}

Se3Spline spline_through(const Controls& controls, int order) {
  return Se3Spline(order, kStart_s, kInterval_s, controls.rotations, controls.positions);
}

/// Instants inside the segments, so far from the knots that numeric differences do not cross them.
std::vector<double> inner_times() {
  std::vector<double> times;
  for (int segment = 0; segment < kSegments; ++segment) {
    for (const double u : {0.05, 0.31, 0.5, 0.77, 0.95}) times.push_back(kStart_s + (segment + u) * kInterval_s);
  }
  return times;
}

class BSpline : public testing::TestWithParam<int> {
 protected:
  int order() const { return GetParam(); }
  Controls controls_ = random_controls(kSegments + GetParam() - 1);
  Se3Spline spline_ = spline_through(controls_, GetParam());
};

INSTANTIATE_TEST_SUITE_P(Orders, BSpline, testing::Values(2, 3, 4, 5, 6), testing::PrintToStringParamName());

TEST_P(BSpline, CoversOneSegmentPerControlPointBeyondTheFirst) {
  EXPECT_EQ(spline_.basis().segments(), kSegments);
  EXPECT_EQ(spline_.start_s(), kStart_s);
  EXPECT_DOUBLE_EQ(spline_.end_s(), kStart_s + kSegments * kInterval_s);
}

TEST_P(BSpline, WeightsAreAPartitionOfUnity) {
  for (const double t : inner_times()) {
    const BasisWeights weights = spline_.basis().weights(t);
    double value = 0.0, first = 0.0, second = 0.0;
    for (int j = 0; j < kMaxSplineOrder; ++j) {
      EXPECT_GE(weights.value[j], 0.0);
      EXPECT_TRUE(j < order() || weights.value[j] == 0.0);
      value += weights.value[j];
      first += weights.first_derivative[j];
      second += weights.second_derivative[j];
    }
    EXPECT_NEAR(value, 1.0, 1e-14);
    EXPECT_NEAR(first, 0.0, 1e-12);
    EXPECT_NEAR(second, 0.0, 1e-10);
  }
}

TEST(BSplineWeights, AreTheTextbookOnesOfTheCubic) {
  const UniformBasis basis(4, 0.0, 1.0, 5);
  const BasisWeights at_knot = basis.weights(1.0);
  EXPECT_EQ(at_knot.first, 1);
  EXPECT_NEAR(at_knot.value[0], 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(at_knot.value[1], 4.0 / 6.0, 1e-15);
  EXPECT_NEAR(at_knot.value[2], 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(at_knot.value[3], 0.0, 1e-15);
  const BasisWeights at_half = basis.cumulative_weights(0.5);
  EXPECT_NEAR(at_half.value[0], 1.0, 1e-15);
  EXPECT_NEAR(at_half.value[1], 47.0 / 48.0, 1e-15);
  EXPECT_NEAR(at_half.value[2], 0.5, 1e-15);
  EXPECT_NEAR(at_half.value[3], 1.0 / 48.0, 1e-15);
}

TEST_P(BSpline, VelocitiesAreTheDerivativesOfThePose) {
  for (const double t : inner_times()) {
    const SplineValue value = spline_.at(t);
    const auto position = [&](double s) -> Vector3d { return spline_.at(s).pose.translation; };
    const auto turned = [&](double s) -> Vector3d {
      return so3_log(value.pose.rotation.conjugate() * spline_.at(s).pose.rotation);
    };
    EXPECT_LT(largest_difference(value.velocity, numeric_derivative(position, t)), 1e-8) << t;
    EXPECT_LT(largest_difference(value.angular_velocity, numeric_derivative(turned, t)), 2e-8) << t;
  }
}

TEST_P(BSpline, AccelerationsAreTheDerivativesOfTheVelocities) {
  for (const double t : inner_times()) {
    const SplineValue value = spline_.at(t);
    const auto velocity = [&](double s) -> Vector3d { return spline_.at(s).velocity; };
    const auto angular_velocity = [&](double s) -> Vector3d { return spline_.at(s).angular_velocity; };
    EXPECT_LT(largest_difference(value.acceleration, numeric_derivative(velocity, t)), 1e-7) << t;
    EXPECT_LT(largest_difference(value.angular_acceleration, numeric_derivative(angular_velocity, t)), 5e-7) << t;
  }
}

TEST_P(BSpline, IsContinuousAtTheKnotsUpToItsOrder) {
  constexpr double kStep = 1e-9;
  for (int knot = 1; knot < kSegments; ++knot) {
    const double t = kStart_s + knot * kInterval_s;
    const SplineValue before = spline_.at(t - kStep), after = spline_.at(t + kStep);
    EXPECT_LT(largest_difference(before.pose.matrix(), after.pose.matrix()), 1e-7);
    if (order() >= 3) {
      EXPECT_LT(largest_difference(before.velocity, after.velocity), 1e-6);
      EXPECT_LT(largest_difference(before.angular_velocity, after.angular_velocity), 1e-6);
    }
    if (order() >= 4) {
      EXPECT_LT(largest_difference(before.acceleration, after.acceleration), 1e-4);
      EXPECT_LT(largest_difference(before.angular_acceleration, after.angular_acceleration), 1e-4);
    }
  }
}

TEST_P(BSpline, MovesWithItsControlPoints) {
  const SE3 world{so3_exp({0.3, 2.0, -0.5}), {10.0, -3.0, 1.0}};
  Controls moved = controls_;
  for (Quaterniond& rotation : moved.rotations) rotation = world.rotation * rotation;
  for (Vector3d& position : moved.positions) position = world * position;
  const Se3Spline spline = spline_through(moved, order());
  for (const double t : inner_times()) {
    const SplineValue value = spline_.at(t), other = spline.at(t);
    EXPECT_LT(largest_difference((world * value.pose).matrix(), other.pose.matrix()), 1e-13);
    EXPECT_LT(largest_difference(world.rotation * value.acceleration, other.acceleration), 1e-11);
    EXPECT_LT(largest_difference(value.angular_acceleration, other.angular_acceleration), 1e-10);
  }
}

TEST_P(BSpline, OfASteadyMotionIsThatMotion) {
  const Vector3d step(0.5, -1.0, 0.3), turn(1.0, 0.4, -0.8);
  const int count = kSegments + order() - 1;
  Controls controls;
  const UniformBasis basis(order(), kStart_s, kInterval_s, count);
  for (int j = 0; j < count; ++j) {
    const double knots = (basis.centre_s(j) - kStart_s) / kInterval_s;
    controls.rotations.push_back(so3_exp(knots * turn));
    controls.positions.push_back(knots * step);
  }
  const Se3Spline spline = spline_through(controls, order());
  for (const double t : inner_times()) {
    const double knots = (t - kStart_s) / kInterval_s;
    const SplineValue value = spline.at(t);
    EXPECT_LT(largest_difference(value.pose.translation, knots * step), 1e-13);
    EXPECT_LT(so3_log(so3_exp(knots * turn).conjugate() * value.pose.rotation).norm(), 1e-13);
    EXPECT_LT(largest_difference(value.velocity, step / kInterval_s), 1e-12);
    EXPECT_LT(largest_difference(value.angular_velocity, turn / kInterval_s), 1e-12);
    EXPECT_LT(largest_difference(value.acceleration, Vector3d::Zero()), 1e-10);
    EXPECT_LT(largest_difference(value.angular_acceleration, Vector3d::Zero()), 1e-10);
  }
}

TEST_P(BSpline, SensitivityIsTheDerivativeWithRespectToTheControlRotations) {
  const UniformBasis& basis = spline_.basis();
  const So3Spline spline(basis, controls_.rotations);
  for (const double t : {kStart_s, kStart_s + 0.4 * kInterval_s, kStart_s + 2.9 * kInterval_s, spline_.end_s()}) {
    const RotationSensitivity sensitivity = spline.sensitivity(t);
    const Quaterniond rotation = spline.at(t).rotation;
    EXPECT_LT(so3_log(sensitivity.rotation.conjugate() * rotation).norm(), 1e-14);
    for (int control = 0; control < basis.control_points(); ++control) {
      const auto reacts = [&](const Vector3d& turn) -> Vector3d {
        std::vector<Quaterniond> rotations = controls_.rotations;
        rotations[control] = rotations[control] * so3_exp(turn);
        return so3_log(rotation.conjugate() * So3Spline(basis, rotations).at(t).rotation);
      };
      const int j = control - sensitivity.first;
      const Matrix3d expected = j < 0 || j >= order() ? Matrix3d(Matrix3d::Zero()) : sensitivity.jacobian[j];
      const Vector3d zero = Vector3d::Zero();
      EXPECT_LT(largest_difference(numeric_jacobian(reacts, zero), expected), 1e-9) << "control " << control;
    }
  }
}

TEST_P(BSpline, IsEvaluatedUpToBothEndsAndNotBeyond) {
  const double beyond = 1e-3 * kInterval_s;
  EXPECT_NO_THROW(spline_.at(spline_.start_s()));
  EXPECT_NO_THROW(spline_.at(spline_.end_s()));
  EXPECT_NO_THROW(spline_.at(spline_.end_s() + 1e-10));
  for (const double t :
       {spline_.start_s() - beyond, spline_.end_s() + beyond, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(spline_.at(t), InternalError) << t;
  }
}

TEST(BSplineErrors, NameTheTimeAndTheRange) {
  const Se3Spline spline(2, 1.0, 0.5, {2, Quaterniond::Identity()}, {2, Vector3d::Zero()});
  const std::string message = test::message_of<InternalError>([&] { spline.at(1.75); });
  EXPECT_TRUE(contains(message, "1.750000000 s"));
  EXPECT_TRUE(contains(message, "[1.000000000, 1.500000000]"));
}

TEST(BSplineErrors, RefuseWrongConstruction) {
  const std::vector<Quaterniond> rotations(5, Quaterniond::Identity());
  const std::vector<Vector3d> positions(5, Vector3d::Zero());
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_NO_THROW(Se3Spline(5, 0.0, 1.0, rotations, positions));
  EXPECT_THROW(Se3Spline(1, 0.0, 1.0, rotations, positions), InternalError);
  EXPECT_THROW(Se3Spline(7, 0.0, 1.0, rotations, positions), InternalError);
  EXPECT_THROW(Se3Spline(6, 0.0, 1.0, rotations, positions), InternalError);
  EXPECT_THROW(Se3Spline(4, 0.0, 1.0, {4, Quaterniond::Identity()}, positions), InternalError);
  EXPECT_THROW(Se3Spline(4, 0.0, 0.0, rotations, positions), InternalError);
  EXPECT_THROW(Se3Spline(4, 0.0, infinity, rotations, positions), InternalError);
  EXPECT_THROW(Se3Spline(4, infinity, 1.0, rotations, positions), InternalError);
  EXPECT_THROW(Se3Spline(4, 0.0, 1.0, {5, Quaterniond(0, 0, 0, 0)}, positions), InternalError);
  EXPECT_THROW(Se3Spline(4, 0.0, 1.0, rotations, {5, Vector3d(0, infinity, 0)}), InternalError);
}

}  // namespace
}  // namespace esim
