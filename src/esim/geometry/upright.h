#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace esim::inline geometry {

/// The smallest rotation that turns the direction `up` to +z, for files with other axes than the world's, whose z axis
/// points up. Its axis is up × z; for up = -z, whose smallest rotations have any horizontal axis, it is a half turn
/// about x. Throws UserError, which starts with "up", if `up` is zero or not finite; its length does not matter
/// otherwise.
Eigen::Quaterniond upright(const Eigen::Vector3d& up);

}  // namespace esim::inline geometry
