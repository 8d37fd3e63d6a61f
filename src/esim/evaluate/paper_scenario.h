#pragma once

#include <filesystem>
#include <string>

#include "esim/scenario/scenario.h"

namespace esim {

/// The set-up of the paper's Section 4.1: camera rotations of varying speed in an equirectangular image at infinity,
/// of 8 bits and after a median of 5 px; 346 x 260 px, 75 degrees wide, thresholds of 0.3. `rotation` is a file with
/// the text of paper_rotation().
Scenario paper_scenario(const std::filesystem::path& panorama, const std::filesystem::path& rotation);

/// 5 s of random rotation, as lines `t x y z qx qy qz qw`: a random spline (motion/random.h) passed through at a speed
/// that peaks once. The mean motion field is about 580 px/s, in the slowest second 330 and in the fastest 1075 px/s, at
/// most 4500 px/s, and the camera turns at up to 1000 degrees per second, which are the paper's figures.
std::string paper_rotation();

}  // namespace esim
