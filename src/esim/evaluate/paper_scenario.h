#pragma once

#include <filesystem>
#include <string>

#include "esim/scenario/scenario.h"

namespace esim::inline evaluate {

/// The setup of the paper's Section 4.1: camera rotations of varying speed in an 8-bit equirectangular image at
/// infinity, smoothed with a median filter of 5 px; 346 x 260 px, horizontal field of view 75 degrees, thresholds 0.3.
/// `rotation` is a file with the text of paper_rotation().
Scenario paper_scenario(const std::filesystem::path& panorama, const std::filesystem::path& rotation);

/// 5 s of random rotation as lines `t x y z qx qy qz qw`: a random spline (motion/random.h), traversed at a speed with
/// one peak. As in the paper, the mean motion field is about 580 px/s (330 px/s in the slowest second, 1075 px/s in the
/// fastest), its maximum is 4500 px/s, and the camera turns at up to 1000 degrees per second.
std::string paper_rotation();

}  // namespace esim::inline evaluate
