#include "esim/scenario/pose_options.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "esim/core/error.h"

namespace esim::inline scenario {

Eigen::Quaterniond looking_along(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d z = direction.normalized();
  Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ());
  if (x.norm() < 1e-6) x = Eigen::Vector3d::UnitX();  // straight up or down: any level x is valid
  x.normalize();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return Eigen::Quaterniond(R).normalized();
}

SE3 pose_of(const PoseOptions& options, const Eigen::Quaterniond& otherwise) {
  SE3 pose{otherwise, options.position};
  if (options.quaternion && options.look_at) {
    throw UserError("quaternion and look_at must not both be given; remove one of them");
  }
  if (options.quaternion) {
    if (!(options.quaternion->norm() > 1e-6)) throw UserError("quaternion must not be [0, 0, 0, 0]; use [0, 0, 0, 1]");
    pose.rotation = Eigen::Quaterniond(options.quaternion->normalized());
  }
  if (options.look_at) {
    const Eigen::Vector3d direction = *options.look_at - options.position;
    if (!(direction.norm() > 1e-9)) throw UserError("look_at must differ from position; choose another point");
    pose.rotation = looking_along(direction);
  }
  return pose;
}

SE3 pose_named(const std::string& key, const PoseOptions& options) {
  try {
    return pose_of(options);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: {}", key, error.what()));
  }
}

PoseOptions options_of(const SE3& pose) {
  PoseOptions options;
  options.position = pose.translation;
  options.quaternion = pose.rotation.coeffs();
  return options;
}

}  // namespace esim::inline scenario
