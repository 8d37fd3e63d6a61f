#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/geometry/calibration.h"
#include "esim/geometry/se3.h"

/// Sparse models of COLMAP (https://colmap.github.io/format.html), as binary files and as text.
namespace esim::inline geometry {

/// A camera as in the file: the meaning of the parameters depends on the model.
struct ColmapCamera {
  std::uint32_t id = 0;
  std::string model;
  double width = 0, height = 0;  // px
  std::vector<double> parameters;
};

/// The pose of one image. Camera frame: x right, y down, z forward, as esim's.
struct ColmapImage {
  std::uint32_t id = 0, camera_id = 0;
  SE3 T_camera_world;
  std::string name;
};

/// Read cameras.{bin,txt} and images.{bin,txt}, in the file's order; the extension says which. Points of images are
/// skipped. Throw UserError, with the file and the line or the byte, for files that are truncated or malformed, numbers
/// that are not finite, zero quaternions, and camera models that are not supported.
std::vector<ColmapCamera> read_colmap_cameras(const std::filesystem::path& file);
std::vector<ColmapImage> read_colmap_images(const std::filesystem::path& file);

/// The cameras of cameras.{bin,txt} as one rig without offsets, ordered by their number, named camera1 for number 1.
/// Throws UserError as above, and for parameters that are not valid.
std::vector<CalibratedCamera> read_colmap_calibration(const std::filesystem::path& file);

}  // namespace esim::inline geometry
