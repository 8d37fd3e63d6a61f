#include "esim/motion/trajectory_file.h"

#include <fmt/format.h>

#include <cmath>

#include "esim/core/error.h"
#include "esim/geometry/reconstruction/reconstruction.h"
#include "esim/geometry/upright.h"
#include "esim/motion/files/image_poses.h"
#include "esim/motion/files/pose_text.h"

namespace esim::inline motion {

void check_options(const TrajectoryFileOptions& options) {
  const auto require_positive = [](const char* name, double value) {
    if (!(value > 0 && std::isfinite(value)))
      throw UserError(fmt::format("{} must be a positive number, not {}", name, value));
  };
  require_positive("scale", options.scale);
  if (options.rate_hz) require_positive("rate_hz", *options.rate_hz);
  if (options.up) upright(*options.up);
}

TrajectoryFile read_trajectory_file(const std::filesystem::path& path, const TrajectoryFileOptions& options) {
  check_options(options);
  TrajectoryFile result;
  bool stamped = true;
  if (const auto found = find_reconstruction(path, ReconstructionPart::images)) {
    const double rate_hz = options.rate_hz.value_or(kImageRate_hz);
    ImagePoses images = read_image_poses(*found, rate_hz);
    stamped = images.stamped;
    if (!stamped) result.rate_hz = rate_hz;
    result.image_up = mean_up(images.poses);
    result.poses = std::move(images.poses);
  } else {
    result.poses = read_pose_text(path);
  }
  if (stamped && options.rate_hz) {
    throw UserError(fmt::format(
        "{}: the file has stamps, so that rate_hz must not be given; remove it, or change the speed by time_scale",
        path.string()));
  }
  const Eigen::Quaterniond turn = options.up ? upright(*options.up) : Eigen::Quaterniond::Identity();
  for (TimedPose& pose : result.poses) {
    SE3& T = pose.T_world_body;
    if (options.scale != 1) T.translation *= options.scale;
    if (options.up) T = SE3{turn, Eigen::Vector3d::Zero()} * T;
    if (!T.translation.allFinite()) {
      throw UserError(
          fmt::format("{}: a position times scale is too large; correct the file or the scale", path.string()));
    }
  }
  return result;
}

std::vector<TimedPose> read_trajectory(const std::filesystem::path& path, const TrajectoryFileOptions& options) {
  return read_trajectory_file(path, options).poses;
}

}  // namespace esim::inline motion
