#pragma once

#include <filesystem>
#include <vector>

#include "esim/motion/timed_pose.h"

namespace esim::inline motion {

/// Reads a list of poses T_world_body, in one of two formats, which are distinguished by their commas:
///
///   TUM        t x y z qx qy qz qw           seconds and metres, separated by white space
///   ESIM CSV   t, x, y, z, qx, qy, qz, qw    nanoseconds and metres, separated by commas
///
/// Lines that begin with '#' and blank lines are skipped; CRLF and trailing blanks are accepted. Stamps are read as
/// decimal numbers, never through `double`, and rounded to the nanosecond. They may be non-uniform within the limit
/// of find_stamp_fault(). Quaternions are normalised, and their signs chosen so that neighbours are close.
///
/// Throws UserError, with file, line and remedy, for a file that cannot be read, malformed lines, numbers that
/// are not finite, zero quaternions, faulty stamps (find_stamp_fault), and fewer than two poses.
std::vector<TimedPose> read_trajectory(const std::filesystem::path& path);

}  // namespace esim::inline motion
