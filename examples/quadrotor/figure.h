#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

/// Where the vehicle was told to be, was, and believed to be, at successive times.
struct Flight {
  std::vector<Eigen::Vector3d> commanded, flown, estimated;
};

/// Draws the paths from above as a PNG file.
void draw(const Flight& flight, const std::filesystem::path& file);
