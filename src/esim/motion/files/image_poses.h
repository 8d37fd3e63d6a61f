#pragma once

#include <optional>
#include <vector>

#include "esim/geometry/reconstruction/reconstruction.h"
#include "esim/motion/timed_pose.h"

// Private to motion.
namespace esim::inline motion {

/// The poses of the images of a reconstruction, in order of time. Without stamps, the images follow each other at
/// `rate_hz`, in the natural order of their names.
struct ImagePoses {
  std::vector<TimedPose> poses;
  bool stamped = false;  ///< whether the stamps are the file's
};
ImagePoses read_image_poses(const ReconstructionFile& file, double rate_hz);

/// The mean direction of the images' upper borders, a unit vector; empty if they cancel each other.
std::optional<Eigen::Vector3d> mean_up(const std::vector<TimedPose>& poses);

}  // namespace esim::inline motion
