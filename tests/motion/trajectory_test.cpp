#include "esim/motion/trajectory.h"

#include <gtest/gtest.h>

#include <random>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/motion/spline.h"
#include "esim/motion/static.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Vector3d;
using test::contains;
using test::largest_difference;
using test::numeric_derivative;

constexpr TimeNs kStart =
    1'403'715'273'262'142'976;  // a present-day stamp, which `double` seconds resolve to 240 ns only

/// A fast motion of 1.5 s.
SplineTrajectory tumbling() {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Vector3d> positions;
  for (int j = 0; j < 9; ++j) {
    rotations.push_back(so3_exp(Vector3d(uniform(engine), uniform(engine), uniform(engine))));
    positions.emplace_back(uniform(engine), uniform(engine), uniform(engine));
  }
  return {Se3Spline(5, -7.0, 0.3, rotations, positions), kStart, kStart + 1'500'000'000};
}

TEST(RigidlyAttached, FollowsTheMotionOfTheAttachedFrame) {
  const SplineTrajectory body = tumbling();
  const SE3 T_body_camera{so3_exp({0.4, -2.0, 1.0}), {0.5, -0.2, 1.3}};
  const Se3Spline& spline = body.spline();
  const auto camera_at = [&](double t_s) {
    const SplineValue v = spline.at(t_s);
    return rigidly_attached({v.pose, v.velocity, v.acceleration, v.angular_velocity, v.angular_acceleration},
                            T_body_camera);
  };
  for (const double t_s : {-6.9, -6.45, -6.0, -5.6}) {
    const Kinematics camera = camera_at(t_s);
    EXPECT_LT(largest_difference(camera.T_world_body.matrix(), (spline.at(t_s).pose * T_body_camera).matrix()), 1e-15);

    const auto position = [&](double s) -> Vector3d { return camera_at(s).T_world_body.translation; };
    const auto turned = [&](double s) -> Vector3d {
      return so3_log(camera.T_world_body.rotation.conjugate() * camera_at(s).T_world_body.rotation);
    };
    const auto velocity = [&](double s) -> Vector3d { return camera_at(s).velocity_world; };
    const auto omega = [&](double s) -> Vector3d { return camera_at(s).omega_body; };
    EXPECT_LT(largest_difference(camera.velocity_world, numeric_derivative(position, t_s)), 1e-7);
    EXPECT_LT(largest_difference(camera.omega_body, numeric_derivative(turned, t_s)), 1e-7);
    EXPECT_LT(largest_difference(camera.acceleration_world, numeric_derivative(velocity, t_s)), 1e-6);
    EXPECT_LT(largest_difference(camera.alpha_body, numeric_derivative(omega, t_s)), 1e-6);
  }
}

TEST(RigidlyAttached, AtTheBodyItselfChangesNothing) {
  const Kinematics body = tumbling().at(kStart + 300'000'000);
  const Kinematics same = rigidly_attached(body, SE3());
  EXPECT_LT(largest_difference(same.acceleration_world, body.acceleration_world), 1e-15);
  EXPECT_LT(largest_difference(same.alpha_body, body.alpha_body), 1e-15);
}

TEST(RigidlyAttached, OnACarouselFeelsTheCentripetalAcceleration) {
  Kinematics carousel;
  carousel.omega_body = {0.0, 0.0, 2.0};
  const Kinematics rider = rigidly_attached(carousel, {Eigen::Quaterniond::Identity(), {3.0, 0.0, 0.0}});
  EXPECT_EQ(rider.velocity_world, Vector3d(0.0, 6.0, 0.0));
  EXPECT_EQ(rider.acceleration_world, Vector3d(-12.0, 0.0, 0.0));
}

TEST(SplineTrajectory, KeepsNanosecondsOfLargeStamps) {
  const SplineTrajectory trajectory = tumbling();
  const TimeNs t = kStart + 700'000'000;
  const Kinematics now = trajectory.at(t), later = trajectory.at(t + 1);
  const Vector3d moved = later.T_world_body.translation - now.T_world_body.translation;
  EXPECT_LT(largest_difference(moved, 1e-9 * now.velocity_world), 1e-14);
}

TEST(SplineTrajectory, CoversItsIntervalAndNothingElse) {
  const SplineTrajectory trajectory = tumbling();
  EXPECT_EQ(trajectory.start(), kStart);
  EXPECT_EQ(trajectory.end(), kStart + 1'500'000'000);
  EXPECT_LT(largest_difference(trajectory.at(kStart).T_world_body.matrix(), trajectory.spline().at(-7.0).pose.matrix()),
            1e-12);
  EXPECT_NO_THROW(trajectory.at(trajectory.end()));
  const std::string message = test::message_of<InternalError>([&] { trajectory.at(trajectory.end() + 1); });
  EXPECT_TRUE(contains(message, "1403715274762142977 ns"));
  EXPECT_TRUE(contains(message, "[1403715273262142976, 1403715274762142976]"));
  EXPECT_THROW(trajectory.at(kStart - 1), InternalError);
}

TEST(SplineTrajectory, RefusesIntervalsThatItsSplineDoesNotCover) {
  const Se3Spline spline = tumbling().spline();
  EXPECT_NO_THROW(SplineTrajectory(spline, 0, 1'000'000'000));
  EXPECT_THROW(SplineTrajectory(spline, 0, 1'500'000'002), InternalError);
  EXPECT_THROW(SplineTrajectory(spline, 0, -1), InternalError);
}

TEST(StaticTrajectory, Rests) {
  const SE3 pose{so3_exp({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0}};
  const StaticTrajectory trajectory(pose, 50, 100);
  EXPECT_EQ(trajectory.start(), 50);
  EXPECT_EQ(trajectory.end(), 150);
  for (const TimeNs t : {50, 99, 150}) {
    const Kinematics kinematics = trajectory.at(t);
    EXPECT_EQ(kinematics.T_world_body.matrix(), pose.matrix());
    EXPECT_EQ(kinematics.velocity_world, Vector3d::Zero());
    EXPECT_EQ(kinematics.acceleration_world, Vector3d::Zero());
    EXPECT_EQ(kinematics.omega_body, Vector3d::Zero());
    EXPECT_EQ(kinematics.alpha_body, Vector3d::Zero());
  }
  EXPECT_THROW(trajectory.at(49), InternalError);
  EXPECT_THROW(trajectory.at(151), InternalError);
  EXPECT_THROW(StaticTrajectory(pose, 0, -1), InternalError);
  EXPECT_NO_THROW(StaticTrajectory(pose, 7, 0).at(7));
}

}  // namespace
}  // namespace esim
