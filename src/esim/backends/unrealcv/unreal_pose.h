#pragma once

#include <Eigen/Core>

#include "esim/geometry/se3.h"

namespace esim {

/// Where something is in Unreal's world: left-handed, x forward, y right, z up. Rotations are about z (yaw, from x
/// towards y), then about the new y (pitch, upwards), then about the new x (roll, clockwise seen from behind).
struct UnrealPose {
  Eigen::Vector3d location_cm = Eigen::Vector3d::Zero();
  double pitch_deg = 0, yaw_deg = 0, roll_deg = 0;  ///< pitch within [-90, 90], the others within [-180, 180]

  bool operator==(const UnrealPose&) const = default;
};

// Our world has the same origin, x and z; its y is Unreal's -y, which makes it right-handed. Things ("actors") have
// frames of x forward, y left, z up here; a camera has x right, y down, z forward.

/// Of an actor.
UnrealPose unreal_pose_of(const SE3& T_world_actor);

/// Of a camera.
UnrealPose unreal_camera_pose_of(const SE3& T_world_camera);

/// The inverses.
SE3 actor_pose_of(const UnrealPose& pose);
SE3 camera_pose_of(const UnrealPose& pose);

}  // namespace esim
