#pragma once

#include <Eigen/Core>

#include "esim/geometry/se3.h"

namespace esim::inline backends::inline unrealcv {

/// A pose in Unreal's world: left-handed, x forward, y right, z up. Rotations are about z (yaw, from x towards y), then
/// about the new y (pitch, upwards), then about the new x (roll, clockwise seen from behind).
struct UnrealPose {
  Eigen::Vector3d location_cm = Eigen::Vector3d::Zero();
  double pitch_deg = 0, yaw_deg = 0, roll_deg = 0;  ///< pitch within [-90, 90], the others within [-180, 180]

  bool operator==(const UnrealPose&) const = default;
};

// esim's world has the same origin, x and z; its y is Unreal's -y, which makes it right-handed. In esim, objects
// ("actors") have frames with x forward, y left, z up; a camera has x right, y down, z forward.

/// The pose of an actor.
UnrealPose unreal_pose_of(const SE3& T_world_actor);

/// The pose of a camera.
UnrealPose unreal_camera_pose_of(const SE3& T_world_camera);

/// The inverses.
SE3 actor_pose_of(const UnrealPose& pose);
SE3 camera_pose_of(const UnrealPose& pose);

}  // namespace esim::inline backends::inline unrealcv
