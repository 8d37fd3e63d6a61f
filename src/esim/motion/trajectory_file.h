#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "esim/motion/timed_pose.h"

namespace esim::inline motion {

/// How the coordinates and times of a file become those of the world.
struct TrajectoryFileOptions {
  std::optional<double> rate_hz{};      ///< images per second of a file without stamps; default kImageRate_hz
  double scale = 1.0;                   ///< metres per unit of the file's positions
  std::optional<Eigen::Vector3d> up{};  ///< the direction in the file that becomes z, by upright(); unset: same axes
};

/// Throws UserError, which starts with the option's name, if an option is not valid.
void check_options(const TrajectoryFileOptions& options);

inline constexpr double kImageRate_hz = 30.0;

struct TrajectoryFile {
  std::vector<TimedPose> poses;             ///< in the world
  std::optional<double> rate_hz;            ///< by which they got their stamps, if the file has none
  std::optional<Eigen::Vector3d> image_up;  ///< in the file: the mean upper side of images, a unit vector
};

/// Reads a list of poses T_world_body. Two formats are text, and are distinguished by their commas:
///
///   TUM        t x y z qx qy qz qw           seconds and metres, separated by white space
///   ESIM CSV   t, x, y, z, qx, qy, qz, qw    nanoseconds and metres, separated by commas
///
/// Lines that begin with '#' and blank lines are skipped; CRLF and trailing blanks are accepted. Stamps are read as
/// decimal numbers, never through `double`, and rounded to the nanosecond. They may be non-uniform within the limit
/// of find_stamp_fault(). Quaternions are normalised, and their signs chosen so that neighbours are close.
///
/// Two others are poses of images, so that the body is their camera (x right, y down, z forward):
///
///   COLMAP           the folder of a model (sparse/0), or its images.bin or images.txt: no stamps
///   transforms.json  of NeRF, nerfstudio and instant-ngp, or its folder: stamps if all frames have `time` or
///   `timestamp`
///
/// Without stamps, the images follow each other at `rate_hz`, in the natural order of their names, from time 0.
///
/// Throws UserError, with file, line and remedy, for a file that cannot be read, malformed lines, numbers that
/// are not finite, zero quaternions, faulty stamps (find_stamp_fault), fewer than two poses, options that are not
/// valid, and a rate for a file with stamps.
TrajectoryFile read_trajectory_file(const std::filesystem::path& path, const TrajectoryFileOptions& options = {});

/// Its poses.
std::vector<TimedPose> read_trajectory(const std::filesystem::path& path, const TrajectoryFileOptions& options = {});

}  // namespace esim::inline motion
