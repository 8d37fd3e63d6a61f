#pragma once

#include <filesystem>
#include <vector>

#include "esim/motion/timed_pose.h"

// Private to motion.
namespace esim::inline motion {

/// Reads TUM and ESIM CSV, with their stamps; see read_trajectory_file().
std::vector<TimedPose> read_pose_text(const std::filesystem::path& path);

}  // namespace esim::inline motion
