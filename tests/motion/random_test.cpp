#include "esim/motion/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Vector3d;
using test::largest_difference;

constexpr TimeNs kStart = 5'000'000'000;
constexpr TimeNs kSecond = kNsPerSecond;

RandomMotionOptions lively() {
  RandomMotionOptions options;
  options.position_amplitude_m = {0.5, 1.0, 0.2};
  options.rotation_amplitude_rad = {0.4, 0.8, 0.3};
  options.knot_interval_s = 0.1;
  options.center = {so3_exp({0.3, -1.0, 2.0}), {10.0, -20.0, 30.0}};
  return options;
}

Vector3d offset_from_center(const Kinematics& kinematics, const RandomMotionOptions& options) {
  return options.center.inverse() * kinematics.T_world_body.translation;
}

TEST(RandomTrajectory, IsAFunctionOfItsSeed) {
  const auto one = random_trajectory(lively(), kStart, kSecond, 42),
             same = random_trajectory(lively(), kStart, kSecond, 42);
  const auto other = random_trajectory(lively(), kStart, kSecond, 43);
  const TimeNs t = kStart + 345'678'901;
  EXPECT_EQ(one.at(t).T_world_body.matrix(), same.at(t).T_world_body.matrix());
  EXPECT_GT((one.at(t).T_world_body.translation - other.at(t).T_world_body.translation).norm(), 1e-3);
  EXPECT_GT(one.at(t).T_world_body.rotation.angularDistance(other.at(t).T_world_body.rotation), 1e-3);
}

TEST(RandomTrajectory, LastsExactlyAsLongAsRequested) {
  for (const TimeNs duration :
       {TimeNs{1}, 99'999'999 * TimeNs{1}, kSecond / 10, 3 * kSecond / 10, 7 * kSecond / 10 + 1}) {
    const auto trajectory = random_trajectory(lively(), kStart, duration, 1);
    EXPECT_EQ(trajectory.start(), kStart);
    EXPECT_EQ(trajectory.end(), kStart + duration);
    EXPECT_NO_THROW(trajectory.at(kStart + duration));
  }
}

TEST(RandomTrajectory, OfLongerDurationOnlyAppends) {
  const auto brief = random_trajectory(lively(), kStart, kSecond, 42);
  const auto extended = random_trajectory(lively(), kStart, 10 * kSecond, 42);
  for (TimeNs t = brief.start(); t < brief.end(); t += 12'345'678) {
    EXPECT_EQ(brief.at(t).T_world_body.matrix(), extended.at(t).T_world_body.matrix());
    EXPECT_EQ(brief.at(t).acceleration_world, extended.at(t).acceleration_world);
    EXPECT_EQ(brief.at(t).alpha_body, extended.at(t).alpha_body);
  }
}

TEST(RandomTrajectory, StaysWithinTheAmplitudesAndUsesThem) {
  const RandomMotionOptions options = lively();
  const auto trajectory = random_trajectory(options, 0, 100 * kSecond, 7);
  Eigen::Array3d lowest = Eigen::Array3d::Zero(), highest = Eigen::Array3d::Zero(), sum = Eigen::Array3d::Zero();
  for (const Vector3d& control : trajectory.spline().positions()) {
    const Eigen::Array3d relative = (options.center.inverse() * control).array() / options.position_amplitude_m.array();
    lowest = lowest.min(relative);
    highest = highest.max(relative);
    sum += relative;
  }
  EXPECT_GE(lowest.minCoeff(), -1.0 - 1e-12);
  EXPECT_LE(highest.maxCoeff(), 1.0 + 1e-12);
  EXPECT_LT(lowest.maxCoeff(), -0.95);
  EXPECT_GT(highest.minCoeff(), 0.95);
  EXPECT_LT((sum / 1004.0).abs().maxCoeff(), 0.1);
  for (TimeNs t = 0; t <= trajectory.end(); t += 17 * kNsPerMs) {
    const Eigen::Array3d offset = offset_from_center(trajectory.at(t), options).array().abs();
    EXPECT_TRUE((offset <= options.position_amplitude_m.array() + 1e-12).all()) << t;
  }
}

TEST(RandomTrajectory, TurnsAboutEachAxisByItsAmplitude) {
  for (int axis = 0; axis < 3; ++axis) {
    RandomMotionOptions options = lively();
    options.rotation_amplitude_rad = 1.4 * Vector3d::Unit(axis);
    const auto trajectory = random_trajectory(options, 0, 100 * kSecond, 7);
    double largest = 0.0;
    for (const Eigen::Quaterniond& control : trajectory.spline().rotations()) {
      const Vector3d turn = so3_log(options.center.rotation.conjugate() * control);
      EXPECT_LT((turn - turn[axis] * Vector3d::Unit(axis)).norm(), 1e-12);
      largest = std::max(largest, std::abs(turn[axis]));
    }
    EXPECT_LE(largest, 1.4 + 1e-12);
    EXPECT_GT(largest, 1.35);
  }
}

TEST(RandomTrajectory, AxesAreIndependent) {
  RandomMotionOptions options = lively();
  options.center = SE3();
  const auto before = random_trajectory(options, 0, kSecond, 3).at(kSecond / 3);
  options.position_amplitude_m.x() = 0.0;
  options.rotation_amplitude_rad.setZero();
  const auto after = random_trajectory(options, 0, kSecond, 3).at(kSecond / 3);
  EXPECT_EQ(after.T_world_body.translation.x(), 0.0);
  EXPECT_EQ(after.T_world_body.translation.tail<2>(), before.T_world_body.translation.tail<2>());
  EXPECT_NE(before.T_world_body.translation.x() / 0.5, before.T_world_body.translation.y() / 1.0);
}

TEST(RandomTrajectory, PositionsAndRotationsAreIndependent) {
  RandomMotionOptions options;
  options.position_amplitude_m = options.rotation_amplitude_rad = Vector3d::UnitX();
  const Se3Spline spline = random_trajectory(options, 0, kSecond, 3).spline();
  ASSERT_EQ(spline.positions().size(), 8u);  // four segments of the default 0.25 s, order 5
  for (std::size_t j = 0; j < spline.positions().size(); ++j) {
    EXPECT_GT(std::abs(spline.positions()[j].x() - so3_log(spline.rotations()[j]).x()), 1e-6);
  }
}

TEST(RandomTrajectory, WithoutAmplitudesRestsAtTheCenter) {
  RandomMotionOptions options = lively();
  options.position_amplitude_m.setZero();
  options.rotation_amplitude_rad.setZero();
  const Kinematics kinematics = random_trajectory(options, 0, kSecond, 3).at(kSecond / 2);
  EXPECT_LT(largest_difference(kinematics.T_world_body.matrix(), options.center.matrix()), 1e-13);
  EXPECT_LT(kinematics.velocity_world.norm() + kinematics.omega_body.norm(), 1e-12);
}

TEST(RandomTrajectory, HasContinuousAcceleration) {
  RandomMotionOptions options = lively();
  options.rotation_amplitude_rad = Vector3d::Constant(4.0 * std::numbers::pi);
  const auto trajectory = random_trajectory(options, 0, 5 * kSecond, 9);
  for (TimeNs knot = kSecond / 10; knot < trajectory.end(); knot += kSecond / 10) {
    const Kinematics before = trajectory.at(knot - 10), after = trajectory.at(knot + 10);
    EXPECT_LT(largest_difference(before.acceleration_world, after.acceleration_world), 1e-3);
    EXPECT_LT(largest_difference(before.alpha_body, after.alpha_body), 0.05);
  }
}

TEST(RandomTrajectory, NamesTheOptionThatIsWrong) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  const auto error_with = [](auto change, TimeNs duration = kSecond) {
    RandomMotionOptions options = lively();
    change(options);
    return test::message_of<UserError>([&] { random_trajectory(options, 0, duration, 1); });
  };
  using Options = RandomMotionOptions;
  using test::contains;
  EXPECT_EQ(error_with([](Options&) {}), "nothing was thrown");
  EXPECT_TRUE(contains(error_with([](Options& o) { o.position_amplitude_m.y() = -0.1; }), "position_amplitude_m"));
  EXPECT_TRUE(contains(error_with([&](Options& o) { o.position_amplitude_m.z() = infinity; }), "position_amplitude_m"));
  EXPECT_TRUE(contains(error_with([&](Options& o) { o.rotation_amplitude_rad.x() = nan; }), "rotation_amplitude_rad"));
  EXPECT_TRUE(contains(error_with([](Options& o) { o.rotation_amplitude_rad.x() = -1; }), "rotation_amplitude_rad"));
  EXPECT_TRUE(contains(error_with([](Options& o) { o.knot_interval_s = 0.0; }), "knot_interval_s"));
  EXPECT_TRUE(contains(error_with([&](Options& o) { o.knot_interval_s = nan; }), "knot_interval_s"));
  EXPECT_TRUE(contains(error_with([](Options& o) { o.knot_interval_s = 1e-9; }), "knot_interval_s is too short"));
  EXPECT_TRUE(contains(error_with([](Options& o) { o.order = 1; }), "order must be in 2 .. 6, not 1"));
  EXPECT_TRUE(contains(error_with([](Options& o) { o.order = 7; }), "order"));
  EXPECT_TRUE(contains(error_with([](Options& o) { o.center.rotation.w() = 5.0; }), "center"));
  EXPECT_TRUE(contains(error_with([](Options&) {}, 0), "duration"));
  EXPECT_TRUE(contains(error_with([](Options&) {}, -1), "duration"));
}

}  // namespace
}  // namespace esim
