#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "esim/core/describe.h"
#include "esim/geometry/se3.h"

namespace esim::inline scenario {

/// A pose as a user writes it: a position, and either a quaternion or a point to look at.
struct PoseOptions {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector4d> quaternion;  ///< x y z w
  std::optional<Eigen::Vector3d> look_at;     ///< the frame's z axis points there, its y axis down (world z is up)
};

template <class Visitor>
void describe(Visitor& visit, PoseOptions& o) {
  visit("position", o.position, About{"origin of the frame", "m"});
  visit("quaternion", o.quaternion, About{"orientation, Hamilton quaternion x y z w"});
  visit("look_at", o.look_at,
        About{"instead of quaternion: the point at which the z axis points; x is level and y points downwards (world z "
              "is up)",
              "m"});
}

/// The rigid motion that `options` describe; `otherwise` is the orientation if they give none. Throws UserError if the
/// quaternion is zero, if both quaternion and look_at are given, or if look_at equals the position.
SE3 pose_of(const PoseOptions& options, const Eigen::Quaterniond& otherwise = Eigen::Quaterniond::Identity());

/// The same; error messages begin with `key`.
SE3 pose_named(const std::string& key, const PoseOptions& options);

/// Options that describe `pose` exactly.
PoseOptions options_of(const SE3& pose);

/// The orientation whose z axis points along `direction`, with x level and y downwards; world z is up.
Eigen::Quaterniond looking_along(const Eigen::Vector3d& direction);

}  // namespace esim::inline scenario
