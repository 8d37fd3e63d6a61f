#include "esim/backends/unrealcv/unreal_pose.h"

#include <cmath>
#include <numbers>

namespace esim::inline backends::inline unrealcv {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0, kCentimetre = 0.01;

/// Converts between the two worlds, in both directions.
Eigen::Vector3d mirrored(const Eigen::Vector3d& v) { return {v.x(), -v.y(), v.z()}; }

/// Rotates a camera's axes to those of an actor that looks in the same direction.
Eigen::Quaterniond R_actor_camera() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // right is -y, down is -z, forward is x
  return Eigen::Quaterniond(R);
}

/// Unreal's axes in its world, after yaw and pitch.
struct Unrolled {
  Eigen::Vector3d forward, right, up;

  Unrolled(double pitch, double yaw)
      : forward(std::cos(pitch) * std::cos(yaw), std::cos(pitch) * std::sin(yaw), std::sin(pitch)),
        right(-std::sin(yaw), std::cos(yaw), 0),
        up(-std::sin(pitch) * std::cos(yaw), -std::sin(pitch) * std::sin(yaw), std::cos(pitch)) {}
};

}  // namespace

UnrealPose unreal_pose_of(const SE3& T_world_actor) {
  const Eigen::Matrix3d R = T_world_actor.rotation.toRotationMatrix();
  const Eigen::Vector3d forward = mirrored(R.col(0)), right = mirrored(-R.col(1));
  const double yaw = std::atan2(forward.y(), forward.x());
  const double pitch = std::atan2(forward.z(), std::hypot(forward.x(), forward.y()));

  // The remaining rotation: if the actor looks straight up or down, the roll compensates for an arbitrary yaw.
  const Unrolled unrolled(pitch, yaw);
  const double roll = std::atan2(-right.dot(unrolled.up), right.dot(unrolled.right));
  return {mirrored(T_world_actor.translation) / kCentimetre, pitch / kDegree, yaw / kDegree, roll / kDegree};
}

SE3 actor_pose_of(const UnrealPose& pose) {
  const Unrolled unrolled(pose.pitch_deg * kDegree, pose.yaw_deg * kDegree);
  const double roll = pose.roll_deg * kDegree;
  Eigen::Matrix3d R;
  R.col(0) = mirrored(unrolled.forward);
  R.col(1) = -mirrored(std::cos(roll) * unrolled.right - std::sin(roll) * unrolled.up);
  R.col(2) = mirrored(std::cos(roll) * unrolled.up + std::sin(roll) * unrolled.right);
  return {Eigen::Quaterniond(R), mirrored(pose.location_cm) * kCentimetre};
}

UnrealPose unreal_camera_pose_of(const SE3& T_world_camera) {
  return unreal_pose_of({T_world_camera.rotation * R_actor_camera().conjugate(), T_world_camera.translation});
}

SE3 camera_pose_of(const UnrealPose& pose) {
  const SE3 T_world_actor = actor_pose_of(pose);
  return {T_world_actor.rotation * R_actor_camera(), T_world_actor.translation};
}

}  // namespace esim::inline backends::inline unrealcv
