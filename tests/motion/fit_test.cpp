#include "esim/motion/fit/fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "esim/geometry/so3.h"
#include "esim/motion/random.h"
#include "motion/fit_motions.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::kEpoch;
using test::largest_difference;
using test::numeric_derivative;
using test::sample;
using test::smooth_motion;
using test::with_noise;

double angle_between(const Quaterniond& a, const Quaterniond& b) { return so3_log(a.conjugate() * b).norm(); }

SE3 pose_at(const FittedTrajectory& fit, double t_s) { return fit.trajectory.at(kEpoch + to_ns(t_s)).T_world_body; }

// What the fit reproduces.

class FitOrder : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Orders, FitOrder, testing::Values(2, 3, 4, 5, 6), testing::PrintToStringParamName());

TEST_P(FitOrder, FindsTheSplineThatThePosesWereTakenFrom) {
  RandomMotionOptions motion;
  motion.position_amplitude_m = {1.0, 2.0, 3.0};
  motion.rotation_amplitude_rad = {0.6, 0.6, 0.6};
  motion.knot_interval_s = 0.1;
  motion.center.translation = {1e5, -2e5, 1e5};
  motion.order = GetParam();
  const SplineTrajectory truth = random_trajectory(motion, kEpoch, 3 * kNsPerSecond, 1);
  const auto poses = sample([&](double t) { return truth.at(kEpoch + to_ns(t)).T_world_body; }, 301, 3.0, 0.45);

  FitOptions options;
  options.order = GetParam();
  options.knot_interval_s = 0.1;
  options.smoothing_time_s = 1e-5;  // negligible
  const FittedTrajectory fit = fit_trajectory(poses, options);
  EXPECT_EQ(fit.report.control_points, 30 + GetParam() - 1);
  EXPECT_EQ(fit.trajectory.start(), kEpoch);
  EXPECT_EQ(fit.trajectory.end(), kEpoch + 3 * kNsPerSecond);
  for (TimeNs t = kEpoch; t <= truth.end(); t += 7 * kNsPerMs) {
    const Kinematics expected = truth.at(t), actual = fit.trajectory.at(t);
    EXPECT_LT((actual.T_world_body.translation - expected.T_world_body.translation).norm(), 1e-8);
    EXPECT_LT(angle_between(actual.T_world_body.rotation, expected.T_world_body.rotation), 1e-8);
    EXPECT_LT((actual.velocity_world - expected.velocity_world).norm(), 1e-6);
    EXPECT_LT((actual.omega_body - expected.omega_body).norm(), 1e-6);
  }
}

TEST(Fit, WithDefaultsReproducesSmoothMotion) {
  for (const double rate_hz : {100.0, 200.0, 1000.0}) {
    const auto poses = sample(smooth_motion, static_cast<int>(4.0 * rate_hz) + 1, 4.0, 0.3);
    const FittedTrajectory fit = fit_trajectory(poses, {});
    EXPECT_LT(fit.report.rms_position_m, 3e-6) << rate_hz;
    EXPECT_LT(fit.report.rms_rotation_rad, 3e-6) << rate_hz;
    for (double t = 0.0; t <= 4.0; t += 0.0137) {
      const SE3 expected = smooth_motion(t);
      EXPECT_LT((pose_at(fit, t).translation - expected.translation).norm(), 2e-5) << rate_hz;
      EXPECT_LT(angle_between(pose_at(fit, t).rotation, expected.rotation), 2e-5) << rate_hz;
    }
    const auto position = [](double s) -> Vector3d { return smooth_motion(s).translation; };
    const auto velocity = [&](double s) -> Vector3d { return numeric_derivative(position, s); };
    for (double t = 0.1; t <= 3.9; t += 0.137) {
      const Kinematics kinematics = fit.trajectory.at(kEpoch + to_ns(t));
      EXPECT_LT((kinematics.velocity_world - velocity(t)).norm(), 2e-3);
      EXPECT_LT((kinematics.acceleration_world - numeric_derivative(velocity, t)).norm(), 0.3);  // of 60 m/s²
    }
  }
}

TEST(Fit, FollowsWholeTurns) {
  const Vector3d rate(3.0, -6.0, 2.0);  // 7 rad/s: eleven turns in 10 s
  const auto poses = sample([&](double t) { return SE3{so3_exp(rate * t), {0.0, 0.0, 0.0}}; }, 501, 10.0, 0.3);
  const FittedTrajectory fit = fit_trajectory(poses, {});
  EXPECT_LT(fit.report.max_rotation_rad, 1e-9);
  for (double t = 0.0; t <= 10.0; t += 0.05) {
    EXPECT_LT((fit.trajectory.at(kEpoch + to_ns(t)).omega_body - rate).norm(), 1e-6) << t;
  }
}

TEST(Fit, FollowsTurnsOfMoreThanAQuarterFromPoseToPose) {
  const Vector3d rate(0.0, 0.0, 120.0 * std::numbers::pi / 180.0 / 0.1);
  const auto poses = sample([&](double t) { return SE3{so3_exp(rate * t), {0.0, 0.0, 0.0}}; }, 41, 4.0);
  const FittedTrajectory fit = fit_trajectory(poses, {});
  EXPECT_LT(fit.report.knot_interval_s, 0.08);
  for (double t = 0.0; t <= 4.0; t += 0.05) {
    EXPECT_LT((fit.trajectory.at(kEpoch + to_ns(t)).omega_body - rate).norm(), 1e-3) << t;
  }
}

TEST(Fit, FollowsFastTumblingInDensePoses) {
  const Vector3d rate(60.0, 80.0, 0.0);  // 1 rad from pose to pose, two poses within the usual 20 ms
  const auto poses = sample([&](double t) { return SE3{so3_exp(rate * t), {0.0, 0.0, 0.0}}; }, 201, 2.0);
  const FittedTrajectory fit = fit_trajectory(poses, {});
  EXPECT_LT(fit.report.knot_interval_s, 0.004);
  EXPECT_LT((fit.trajectory.at(kEpoch + kNsPerSecond).omega_body - rate).norm(), 1e-3);
}

TEST(Fit, OfTwoPosesIsTheSteadyMotionBetweenThem) {
  const Vector3d turn(0.3, -2.0, 0.5), step(1.0, 2.0, -3.0);
  for (const int order : {2, 3, 4, 5, 6}) {
    const auto poses = sample([&](double t) { return SE3{so3_exp(t / 2.0 * turn), t / 2.0 * step}; }, 2, 2.0);
    FitOptions options;
    options.order = order;
    const FittedTrajectory fit = fit_trajectory(poses, options);
    for (const double t : {0.0, 0.6, 2.0}) {
      const Kinematics kinematics = fit.trajectory.at(kEpoch + to_ns(t));
      EXPECT_LT((kinematics.T_world_body.translation - t / 2.0 * step).norm(), 1e-9) << order;
      EXPECT_LT((kinematics.velocity_world - 0.5 * step).norm(), 1e-8) << order;
      EXPECT_LT((kinematics.omega_body - 0.5 * turn).norm(), 1e-8) << order;
    }
  }
}

TEST(Fit, PassesThroughSparseWaypoints) {
  std::mt19937 engine(8);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<TimedPose> waypoints;
  for (int i = 0; i < 12; ++i) {
    const Vector3d turn(uniform(engine), uniform(engine), uniform(engine));
    waypoints.push_back({kEpoch + i * kNsPerSecond, {so3_exp(turn), {uniform(engine), uniform(engine), 0.0}}});
  }
  for (std::size_t count = 2; count <= waypoints.size(); ++count) {
    const FittedTrajectory fit = fit_trajectory(std::span(waypoints).first(count), {});
    EXPECT_LT(fit.report.max_position_m, 1e-6) << count;
    EXPECT_LT(fit.report.max_rotation_rad, 1e-6) << count;
    EXPECT_NEAR(fit.report.smoothing_time_s, fit.report.knot_interval_s / 20.0, 1e-12);
    double farthest = 0.0;
    for (TimeNs t = fit.trajectory.start(); t <= fit.trajectory.end(); t += 10 * kNsPerMs) {
      farthest = std::max(farthest, fit.trajectory.at(t).T_world_body.translation.norm());
    }
    EXPECT_LT(farthest, 3.0) << count;
  }
}

TEST(Fit, MovesWithItsPoses) {
  const SE3 world{so3_exp({0.3, 2.0, -0.5}), {1000.0, -3000.0, 100.0}};
  const auto poses = with_noise(sample(smooth_motion, 201, 1.0, 0.3), 0.01);
  std::vector<TimedPose> moved = poses;
  for (TimedPose& pose : moved) pose.T_world_body = world * pose.T_world_body;
  const FittedTrajectory fit = fit_trajectory(poses, {}), fit_of_moved = fit_trajectory(moved, {});
  for (double t = 0.0; t <= 1.0; t += 0.013) {
    EXPECT_LT(largest_difference((world * pose_at(fit, t)).matrix(), pose_at(fit_of_moved, t).matrix()), 1e-8);
  }
}

TEST(Fit, LosesNoDigitsFarFromTheOrigin) {
  const auto poses = sample(smooth_motion, 21, 2.0);
  std::vector<TimedPose> moved = poses;
  const Vector3d far(0x1p20, -0x1p21, 0x1p20);
  for (TimedPose& pose : moved) pose.T_world_body.translation += far;
  const FittedTrajectory fit = fit_trajectory(poses, {}), fit_of_moved = fit_trajectory(moved, {});
  for (double t = 0.0; t <= 2.0; t += 0.013) {
    EXPECT_LT((pose_at(fit, t).translation + far - pose_at(fit_of_moved, t).translation).norm(), 2e-9) << t;
  }
}

// The rounding errors of a linear solve, which sparse poses amplify, would depend on the unit of length.
TEST(Fit, OfSparsePositionsIsExactToRounding) {
  const auto poses = sample(smooth_motion, 251, 5.0, 0.0);
  auto tripled = poses;
  for (TimedPose& pose : tripled) pose.T_world_body.translation *= 3;
  const FittedTrajectory one = fit_trajectory(poses, {}), three = fit_trajectory(tripled, {});
  ASSERT_LT(one.report.knot_interval_s, 0.015) << "closer than the poses";
  double largest_m = 0;
  for (double t = 0; t < 5; t += 0.0037) {
    const Vector3d difference_m = pose_at(three, t).translation / 3 - pose_at(one, t).translation;
    largest_m = std::max(largest_m, difference_m.norm());
  }
  EXPECT_LT(largest_m, 1e-13);
}

TEST(Fit, DoesNotMindTheSignsOfQuaternions) {
  const auto poses = sample(smooth_motion, 201, 1.0);
  std::vector<TimedPose> flipped = poses;
  for (std::size_t i = 0; i < flipped.size(); i += 3) flipped[i].T_world_body.rotation.coeffs() *= -1.0;
  const FittedTrajectory fit = fit_trajectory(poses, {}), fit_of_flipped = fit_trajectory(flipped, {});
  EXPECT_LT(largest_difference(pose_at(fit, 0.47).matrix(), pose_at(fit_of_flipped, 0.47).matrix()), 1e-12);
}

// What it minimises.

/// The documented cost of the rotations, computed from the spline alone.
double rotation_cost(const Se3Spline& spline, const std::vector<TimedPose>& poses, double weight) {
  double cost = 0.0;
  for (const TimedPose& pose : poses) {
    const Quaterniond at_pose = spline.at(to_seconds(pose.t - kEpoch)).pose.rotation;
    cost += so3_log(at_pose.conjugate() * pose.T_world_body.rotation).squaredNorm();
  }
  const auto increment = [&](std::size_t j) {
    return so3_log(spline.rotations()[j].conjugate() * spline.rotations()[j + 1]);
  };
  for (std::size_t j = 0; j + 3 < spline.rotations().size(); ++j) {
    cost += weight * (increment(j + 2) - 2.0 * increment(j + 1) + increment(j)).squaredNorm();
  }
  return cost;
}

double position_cost(const Se3Spline& spline, const std::vector<TimedPose>& poses, double weight) {
  double cost = 0.0;
  for (const TimedPose& pose : poses) {
    cost += (spline.at(to_seconds(pose.t - kEpoch)).pose.translation - pose.T_world_body.translation).squaredNorm();
  }
  const auto& p = spline.positions();
  for (std::size_t j = 0; j + 3 < p.size(); ++j) {
    cost += weight * (p[j + 3] - 3.0 * p[j + 2] + 3.0 * p[j + 1] - p[j]).squaredNorm();
  }
  return cost;
}

TEST(Fit, ReachesTheMinimumOfItsCosts) {
  // Strong noise and large turns between knots, so that the problem is far from linear.
  const auto poses = with_noise(sample([](double t) { return smooth_motion(3.0 * t); }, 51, 1.0), 0.1);
  FitOptions options;
  options.knot_interval_s = 0.05;
  options.smoothing_time_s = 0.02;
  const FittedTrajectory fit = fit_trajectory(poses, options);
  const Se3Spline& best = fit.trajectory.spline();
  const double h = fit.report.knot_interval_s, interval_s = 0.02;
  const double weight = std::pow(0.02, 6) / interval_s / std::pow(h, 5);

  const auto changed = [&](std::size_t j, const Vector3d& turn, const Vector3d& step) {
    std::vector<Quaterniond> rotations = best.rotations();
    std::vector<Vector3d> positions = best.positions();
    rotations[j] = rotations[j] * so3_exp(turn);
    positions[j] += step;
    return Se3Spline(5, 0.0, h, rotations, positions);
  };
  const double min_rotation = rotation_cost(best, poses, weight), min_position = position_cost(best, poses, weight);
  EXPECT_GT(min_rotation, 0.1);
  for (std::size_t j = 0; j < best.rotations().size(); ++j) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto rotated = [&](double s) {
        return rotation_cost(changed(j, s * Vector3d::Unit(axis), Vector3d::Zero()), poses, weight);
      };
      const auto shifted = [&](double s) {
        return position_cost(changed(j, Vector3d::Zero(), s * Vector3d::Unit(axis)), poses, weight);
      };
      EXPECT_LT(std::abs(numeric_derivative(rotated, 0.0)), 1e-11 * min_rotation) << j;
      EXPECT_LT(std::abs(numeric_derivative(shifted, 0.0)), 1e-11 * min_position) << j;
      EXPECT_GT(rotated(1e-4), min_rotation);
      EXPECT_GT(rotated(-1e-4), min_rotation);
    }
  }
}

TEST(Fit, ReportsTheResidualsOfItsTrajectory) {
  const auto poses = with_noise(sample(smooth_motion, 301, 2.0, 0.3), 0.01);
  const FittedTrajectory fit = fit_trajectory(poses, {});
  double position_sum = 0.0, rotation_sum = 0.0, position_max = 0.0, rotation_max = 0.0;
  for (const TimedPose& pose : poses) {
    const SE3 difference = fit.trajectory.at(pose.t).T_world_body.inverse() * pose.T_world_body;
    const double position = difference.translation.norm(),
                 rotation = angle_between(SE3().rotation, difference.rotation);
    position_sum += position * position;
    rotation_sum += rotation * rotation;
    position_max = std::max(position_max, position);
    rotation_max = std::max(rotation_max, rotation);
  }
  EXPECT_NEAR(fit.report.rms_position_m, std::sqrt(position_sum / 301.0), 1e-12);
  EXPECT_NEAR(fit.report.rms_rotation_rad, std::sqrt(rotation_sum / 301.0), 1e-12);
  EXPECT_NEAR(fit.report.max_position_m, position_max, 1e-12);
  EXPECT_NEAR(fit.report.max_rotation_rad, rotation_max, 1e-12);
  EXPECT_NEAR(fit.report.smoothing_time_s, fit.report.knot_interval_s / 5.0, 1e-15);
  EXPECT_EQ(fit.report.control_points, static_cast<int>(fit.trajectory.spline().positions().size()));
  EXPECT_EQ(fit.report.knot_interval_s, fit.trajectory.spline().basis().knot_interval_s());
}

TEST(Fit, AveragesNoise) {
  constexpr double kSigma = 0.01;
  const auto poses = with_noise(sample(smooth_motion, 2001, 10.0, 0.3), kSigma);
  const FittedTrajectory fit = fit_trajectory(poses, {});
  // Of 3·2001 measurements 3·504 degrees of freedom follow the noise, as in any linear regression.
  EXPECT_NEAR(fit.report.control_points, 504, 2);
  const double expected = kSigma * std::sqrt(3.0 * (1.0 - 504.0 / 2001.0));
  EXPECT_NEAR(fit.report.rms_position_m, expected, 0.05 * expected);
  EXPECT_NEAR(fit.report.rms_rotation_rad, expected, 0.05 * expected);
  double error = 0.0;
  for (const TimedPose& pose : poses) {
    const SE3 truth = smooth_motion(to_seconds(pose.t - kEpoch));
    error += (pose_at(fit, to_seconds(pose.t - kEpoch)).translation - truth.translation).squaredNorm() / 2001.0;
  }
  EXPECT_NEAR(std::sqrt(error), kSigma * std::sqrt(3.0 * 504.0 / 2001.0), 0.1 * kSigma);
}

TEST(Fit, AttenuatesBySmoothingTimeAndFrequencyAlone) {
  // A sinusoid with τω = 1 is halved, for any knot interval and rate.
  constexpr double kOmega = 10.0;
  const auto swing = [](double t) {
    const double s = std::sin(kOmega * t);
    return SE3{so3_exp({0.0, 0.01 * s, 0.0}), {s, 0.0, 0.0}};
  };
  for (const double knot_interval_s : {0.02, 0.04}) {
    for (const int count : {2001, 801}) {
      FitOptions options;
      options.knot_interval_s = knot_interval_s;
      options.smoothing_time_s = 1.0 / kOmega;
      const FittedTrajectory fit = fit_trajectory(sample(swing, count, 10.0), options);
      const double peak_s = (8.0 * 2.0 + 0.5) * std::numbers::pi / kOmega;  // the middle, far from the ends
      EXPECT_NEAR(pose_at(fit, peak_s).translation.x(), 0.5, 0.01);
      EXPECT_NEAR(so3_log(pose_at(fit, peak_s).rotation).y(), 0.005, 0.0001);
    }
  }
}

}  // namespace
}  // namespace esim
