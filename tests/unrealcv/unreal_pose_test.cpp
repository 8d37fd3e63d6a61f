#include "esim/backends/unrealcv/unreal_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "esim/geometry/so3.h"

namespace esim {
namespace {

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return so3_log(a.conjugate() * b).norm();
}

/// Unreal's definition of a rotator: the rotated axes, in components of its left-handed world.
Eigen::Matrix3d unreal_axes(const UnrealPose& pose) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double p = pose.pitch_deg * kDegree, y = pose.yaw_deg * kDegree, r = pose.roll_deg * kDegree;
  const double sp = std::sin(p), cp = std::cos(p), sy = std::sin(y), cy = std::cos(y), sr = std::sin(r),
               cr = std::cos(r);
  Eigen::Matrix3d rows;                                          // x, y and z axis
  rows << cp * cy, cp * sy, sp,                                  //
      sr * sp * cy - cr * sy, sr * sp * sy + cr * cy, -sr * cp,  //
      -(cr * sp * cy + sr * sy), cy * sr - cr * sp * sy, cr * cp;
  return rows;
}

TEST(UnrealPose, ACameraLooksWhereUnrealsForwardPoints) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-180, 180), pitch(-90, 90);
  const Eigen::Vector3d mirror(1, -1, 1);
  for (int i = 0; i < 500; ++i) {
    const UnrealPose pose{{100, -250, 30}, pitch(random), angle(random), angle(random)};
    const Eigen::Matrix3d axes = unreal_axes(pose);
    const auto ours = [&](int row) -> Eigen::Vector3d { return mirror.cwiseProduct(axes.row(row).transpose()); };
    const SE3 camera = camera_pose_of(pose);
    const Eigen::Matrix3d R = camera.rotation.toRotationMatrix();
    EXPECT_NEAR(R.determinant(), 1, 1e-12);
    EXPECT_LT((R.col(2) - ours(0)).norm(), 1e-12) << "z: forward";
    EXPECT_LT((R.col(0) - ours(1)).norm(), 1e-12) << "x: right";
    EXPECT_LT((R.col(1) + ours(2)).norm(), 1e-12) << "y: down";
    EXPECT_LT((camera.translation - Eigen::Vector3d(1, 2.5, 0.3)).norm(), 1e-12);

    const Eigen::Matrix3d actor = actor_pose_of(pose).rotation.toRotationMatrix();
    EXPECT_LT((actor.col(0) - ours(0)).norm(), 1e-12);
    EXPECT_LT((actor.col(1) + ours(1)).norm(), 1e-12) << "y: left";
    EXPECT_LT((actor.col(2) - ours(2)).norm(), 1e-12);
  }
}

TEST(UnrealPose, EveryPoseComesBack) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 2000; ++i) {
    SE3 pose{{normal(random), normal(random), normal(random), normal(random)},
             10 * Eigen::Vector3d(normal(random), normal(random), normal(random))};
    pose.rotation.normalize();
    if (i % 4 == 0) {  // straight up or down, or nearly
      const double nearly = i % 8 == 0 ? 0 : std::pow(10.0, -3 - i % 13);
      const double up = (i % 16 < 8 ? 1 : -1) * std::numbers::pi / 2 + nearly;
      pose.rotation = so3_exp({0, 0, normal(random)}) * so3_exp({0, -up, 0}) * so3_exp({normal(random), 0, 0});
    }
    for (const bool of_camera : {false, true}) {
      const UnrealPose there = of_camera ? unreal_camera_pose_of(pose) : unreal_pose_of(pose);
      const SE3 back = of_camera ? camera_pose_of(there) : actor_pose_of(there);
      EXPECT_LT(angle_between(back.rotation, pose.rotation), 1e-7) << i;
      EXPECT_LT((back.translation - pose.translation).norm(), 1e-12);
      EXPECT_LE(std::fabs(there.pitch_deg), 90);
      EXPECT_LE(std::max(std::fabs(there.yaw_deg), std::fabs(there.roll_deg)), 180);
    }
  }
}

TEST(UnrealPose, KnownOnes) {
  // A camera that looks along esim's world x with its x axis to the right has Unreal's zero rotation.
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const UnrealPose zero = unreal_camera_pose_of({Eigen::Quaterniond(R), {1, 2, 3}});
  EXPECT_LT((zero.location_cm - Eigen::Vector3d(100, -200, 300)).norm(), 1e-9);
  EXPECT_NEAR(std::fabs(zero.pitch_deg) + std::fabs(zero.yaw_deg) + std::fabs(zero.roll_deg), 0, 1e-9);

  // To the left, which is esim's y: yaw -90. Upwards: pitch 45.
  EXPECT_NEAR(unreal_pose_of({so3_exp({0, 0, std::numbers::pi / 2}), {}}).yaw_deg, -90, 1e-9);
  EXPECT_NEAR(unreal_pose_of({so3_exp({0, -std::numbers::pi / 4, 0}), {}}).pitch_deg, 45, 1e-9);
  EXPECT_NEAR(unreal_pose_of({so3_exp({0.3, 0, 0}), {}}).roll_deg, 0.3 * 180 / std::numbers::pi, 1e-9)
      << "clockwise, seen from behind";
}

}  // namespace
}  // namespace esim
