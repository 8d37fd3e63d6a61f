#include "esim/motion/online.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using test::contains;

constexpr TimeNs kInterval = 5 * kNsPerMs;

SE3 lively_pose(double t_s) {
  return {so3_exp(Eigen::Vector3d(0.5 * std::sin(3 * t_s), 0.4 * std::cos(2 * t_s), t_s)),
          Eigen::Vector3d(std::sin(4 * t_s), 0.3 * t_s * t_s, std::cos(5 * t_s))};
}

class Online : public testing::TestWithParam<int> {
 protected:
  OnlineTrajectory trajectory(const SE3& initial = lively_pose(0)) const {
    return {{.start = 7, .interval = kInterval, .order = GetParam()}, initial};
  }
};

bool same_bits(const Kinematics& a, const Kinematics& b) {
  return a.T_world_body.rotation.coeffs() == b.T_world_body.rotation.coeffs() &&
         a.T_world_body.translation == b.T_world_body.translation && a.velocity_world == b.velocity_world &&
         a.acceleration_world == b.acceleration_world && a.omega_body == b.omega_body && a.alpha_body == b.alpha_body;
}

TEST_P(Online, IsFinalUntilItsLatencyBeforeTheNewestPose) {
  OnlineTrajectory motion = trajectory();
  EXPECT_EQ(motion.latency(), (GetParam() / 2 - 1) * kInterval);
  EXPECT_EQ(motion.final_until(), motion.start());
  std::vector<std::pair<TimeNs, Kinematics>> seen = {{7, motion.at(7)}};
  for (int k = 1; k <= 40; ++k) {
    const TimeNs before = motion.final_until();
    motion.push(lively_pose(0.005 * k));
    EXPECT_EQ(motion.final_until(), before + kInterval);
    EXPECT_EQ(motion.newest(), motion.final_until() + motion.latency());
    for (const TimeNs step : {TimeNs{1}, kInterval / 3, kInterval - 1, kInterval})
      seen.emplace_back(before + step, motion.at(before + step));
  }
  EXPECT_THROW(motion.at(motion.final_until() + 1), InternalError);
  EXPECT_THROW(motion.at(6), InternalError);
  for (int k = 41; k <= 60; ++k) motion.push(lively_pose(-0.004 * k));
  for (const auto& [t, kinematics] : seen) EXPECT_TRUE(same_bits(motion.at(t), kinematics)) << t;
}

TEST_P(Online, RestsAtFirstAndThenFollowsThePoses) {
  OnlineTrajectory motion = trajectory();
  EXPECT_LT((motion.at(7).T_world_body.translation - lively_pose(0).translation).norm(), 1e-15);
  EXPECT_LT(motion.at(7).velocity_world.norm(), 1e-12);
  EXPECT_LT(motion.at(7).omega_body.norm(), 1e-12);
  for (int k = 1; k <= 200; ++k) motion.push(lively_pose(0.005 * k));
  // Pushed pose k belongs to start + latency + k intervals. A cubic stays within h²/6 |p''| of it, a quintic within
  // h²/4 |p''|; |p''| is below 45 m/s².
  for (int k = 20; k <= 150; ++k) {
    const TimeNs t = 7 + motion.latency() + k * kInterval;
    const SE3 pose = motion.at(t).T_world_body;
    EXPECT_LT((pose.translation - lively_pose(0.005 * k).translation).norm(), 0.005 * 0.005 / 4 * 45);
    EXPECT_LT(so3_log(pose.rotation.conjugate() * lively_pose(0.005 * k).rotation).norm(), 1e-4);
  }
}

TEST_P(Online, DerivativesAgreeWithDifferences) {
  OnlineTrajectory motion = trajectory();
  for (int k = 1; k <= 100; ++k) motion.push(lively_pose(0.005 * k));
  const auto at = [&](double t_s) { return motion.at(7 + to_ns(t_s)); };
  const auto position = [&](double t_s) { return Eigen::Vector3d(at(t_s).T_world_body.translation); };
  const auto velocity = [&](double t_s) { return Eigen::Vector3d(at(t_s).velocity_world); };
  for (const double t_s : {0.0625, 0.1875, 0.3025, 0.4444}) {
    EXPECT_LT((at(t_s).velocity_world - test::numeric_derivative(position, t_s, 1e-4)).norm(), 1e-6);
    EXPECT_LT((at(t_s).acceleration_world - test::numeric_derivative(velocity, t_s, 1e-4)).norm(), 1e-5);
  }
}

TEST_P(Online, IntegratesAccelerationsAndRates) {
  OnlineTrajectory motion = trajectory(SE3{});
  const Eigen::Vector3d acceleration(0.5, 0, -1), omega(0, 0, 0.7);
  for (int k = 0; k < 400; ++k) motion.push_motion(acceleration, omega);
  // Well after the start, the motion is the parabola and the rotation that begin at newest() at the first push.
  const TimeNs t = motion.start() + kNsPerSecond;
  const double moved_s = 1.0 - to_seconds(motion.latency());
  const Kinematics now = motion.at(t);
  EXPECT_LT((now.acceleration_world - acceleration).norm(), 1e-8);
  EXPECT_LT((now.velocity_world - moved_s * acceleration).norm(), 1e-9);
  EXPECT_LT((now.omega_body - omega).norm(), 1e-12);
  EXPECT_LT((now.T_world_body.translation - moved_s * moved_s / 2 * acceleration).norm(), 1e-5);
  EXPECT_NEAR(so3_log(now.T_world_body.rotation).z(), 0.7 * moved_s, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Orders, Online, testing::Values(4, 6));

TEST(OnlineErrors, RefusesWhatIsNoMotion) {
  const auto message = [](OnlineMotionOptions options, const SE3& pushed) {
    return test::message_of<UserError>([&] { OnlineTrajectory(options, SE3{}).push(pushed); });
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(contains(message({.interval = 0}, {}), "interval is 0 ns"));
  EXPECT_TRUE(contains(message({.order = 5}, {}), "order is 5; it must be 4 or 6"));
  EXPECT_TRUE(contains(message({.order = -5}, {}), "order is -5"));
  EXPECT_TRUE(contains(message({}, {Eigen::Quaterniond::Identity(), {0, kNan, 0}}), "not finite"));
  EXPECT_TRUE(contains(message({}, {Eigen::Quaterniond(2, 0, 0, 0), {0, 0, 0}}), "unit norm"));
  EXPECT_TRUE(contains(message({}, {Eigen::Quaterniond(0, 1, 0, 0), {0, 0, 0}}), "180 deg"));
  EXPECT_EQ(message({}, {}), "nothing was thrown");
  EXPECT_THROW(OnlineTrajectory({}, {Eigen::Quaterniond::Identity(), {kNan, 0, 0}}), UserError);
}

}  // namespace
}  // namespace esim
