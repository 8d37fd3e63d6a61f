#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

/// The commanded, true and estimated positions of the vehicle at successive times.
struct Flight {
  std::vector<Eigen::Vector3d> commanded, flown, estimated;
};

/// Draws the paths from above as a PNG file.
void draw(const Flight& flight, const std::filesystem::path& file);
