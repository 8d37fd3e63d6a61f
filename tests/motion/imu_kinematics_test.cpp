#include "esim/motion/imu_kinematics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "esim/geometry/so3.h"
#include "esim/motion/fit/fit.h"
#include "esim/motion/random.h"
#include "esim/motion/static.h"
#include "esim/motion/trajectory_file.h"
#include "support/numeric.h"
#include "support/test_data.h"

namespace esim {
namespace {

const Eigen::Vector3d kGravity(0, 0, -9.81);

SE3 some_pose() { return {so3_exp(Eigen::Vector3d(0.4, -1.1, 2.0)), Eigen::Vector3d(0.07, -0.12, 0.2)}; }

SplineTrajectory lively_trajectory(TimeNs duration) {
  RandomMotionOptions options;
  options.position_amplitude_m = {0.5, 0.7, 0.3};
  options.rotation_amplitude_rad = {0.5, 0.4, 0.8};
  options.knot_interval_s = 0.2;
  options.order = 6;
  return random_trajectory(options, 0, duration, 3);
}

TEST(ImuKinematics, AtRestFeelsTheSupportThatHoldsItAgainstGravity) {
  const SE3 T_world_body{so3_exp(Eigen::Vector3d(0.3, 0.2, -0.5)), Eigen::Vector3d(1, 2, 3)};
  const StaticTrajectory rest(T_world_body, 0, kNsPerSecond);
  const InertialSignals felt = inertial_signals(rest.at(0), some_pose(), kGravity);
  EXPECT_EQ(felt.angular_rate.norm(), 0);
  const Eigen::Vector3d felt_world = (T_world_body * some_pose()).rotation * felt.specific_force;
  EXPECT_LT((felt_world + kGravity).norm(), 1e-14);
}

TEST(ImuKinematics, LeverArmAgreesWithDifferencesOfPositionsAndRotations) {
  const SplineTrajectory trajectory = lively_trajectory(2 * kNsPerSecond);
  const auto pose_at = [&](double t_s) { return trajectory.at(to_ns(t_s)).T_world_body * some_pose(); };
  const auto position = [&](double t_s) { return Eigen::Vector3d(pose_at(t_s).translation); };
  const auto velocity = [&](double t_s) { return test::numeric_derivative(position, t_s, 2e-3); };
  for (double t_s = 0.11; t_s < 1.9; t_s += 0.17) {
    const SE3 here = pose_at(t_s);
    const auto turn = [&](double s) { return so3_log(here.rotation.conjugate() * pose_at(s).rotation); };
    const InertialSignals felt = inertial_signals(trajectory.at(to_ns(t_s)), some_pose(), kGravity);
    const Eigen::Vector3d acceleration = test::numeric_derivative(velocity, t_s, 2e-3);
    EXPECT_LT((here.rotation * felt.specific_force - (acceleration - kGravity)).norm(), 2e-4) << t_s;
    EXPECT_LT((felt.angular_rate - test::numeric_derivative(turn, t_s)).norm(), 1e-6) << t_s;
  }
}

/// Pose and velocity of an IMU.
struct InertialState {
  SE3 T_world_imu;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

/// Integrates the measurements of an IMU at `T_body_imu` at `rate_hz` on a trajectory from its start, for `duration_s`,
/// by the fourth-order Runge-Kutta method; each step uses the measurements at its ends and in its middle.
InertialState integrate(const Trajectory& trajectory, const SE3& T_body_imu, double duration_s, double rate_hz) {
  const auto felt = [&](int measurement) {
    const TimeNs t = trajectory.start() + to_ns(measurement / rate_hz);
    return inertial_signals(trajectory.at(t), T_body_imu, kGravity);
  };
  const Kinematics first = rigidly_attached(trajectory.at(trajectory.start()), T_body_imu);
  InertialState state{first.T_world_body, first.velocity_world};
  const double h = 2 / rate_hz;
  for (int k = 0; k < static_cast<int>(duration_s * rate_hz / 2); ++k) {
    const InertialSignals a = felt(2 * k), b = felt(2 * k + 1), c = felt(2 * k + 2);
    // The rotation vector θ since the step's beginning obeys θ' = Jr⁻¹(θ) ω.
    const auto rate = [](const Eigen::Vector3d& theta, const InertialSignals& s) {
      return Eigen::Vector3d(so3_right_jacobian_inverse(theta) * s.angular_rate);
    };
    const Eigen::Vector3d k1 = rate(Eigen::Vector3d::Zero(), a), k2 = rate(h / 2 * k1, b), k3 = rate(h / 2 * k2, b),
                          k4 = rate(h * k3, c);
    const Eigen::Quaterniond& R = state.T_world_imu.rotation;
    const auto acceleration = [&](const Eigen::Vector3d& theta, const InertialSignals& s) {
      return Eigen::Vector3d(R * (so3_exp(theta) * s.specific_force) + kGravity);
    };
    const Eigen::Vector3d a1 = acceleration(Eigen::Vector3d::Zero(), a), a2 = acceleration(h / 2 * k1, b),
                          a3 = acceleration(h / 2 * k2, b), a4 = acceleration(h * k3, c);
    state.T_world_imu.translation += h * state.velocity + h * h / 6 * (a1 + a2 + a3);
    state.velocity += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    state.T_world_imu.rotation = (R * so3_exp(h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))).normalized();
  }
  return state;
}

void expect_back_on(const Trajectory& trajectory, double duration_s) {
  const InertialState state = integrate(trajectory, some_pose(), duration_s, 1000);
  const SE3 truth = trajectory.at(trajectory.start() + to_ns(duration_s)).T_world_body * some_pose();
  EXPECT_LT((state.T_world_imu.translation - truth.translation).norm(), 1e-3);
  const double angle = so3_log(truth.rotation.conjugate() * state.T_world_imu.rotation).norm();
  EXPECT_LT(angle * 180 / std::numbers::pi, 0.01);
}

TEST(ImuKinematics, IntegratesToTheTrajectory) { expect_back_on(lively_trajectory(10 * kNsPerSecond), 10); }

TEST(ImuKinematics, IntegratesToAMotionCaptureTrajectory) {
  const auto file = test::test_data("trajectory/poster_6dof.csv");
  if (!file) GTEST_SKIP() << "needs ESIM_TEST_DATA";
  expect_back_on(fit_trajectory(read_trajectory(*file), {}).trajectory, 10);
}

}  // namespace
}  // namespace esim
