#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "esim/geometry/reconstruction/colmap.h"

// Private to geometry.
namespace esim::inline geometry {

/// A camera model of COLMAP.
struct ColmapModel {
  std::string_view name;
  std::size_t parameters = 0;  ///< their number
};

/// Throw UserError, without naming the file, if the model is not supported.
const ColmapModel& colmap_model(std::int32_t number);
const ColmapModel& colmap_model(std::string_view name);

/// The image with a unit quaternion. `q` is w x y z, world to camera. Throws UserError, without naming the file, for
/// numbers that are not finite and for a zero quaternion.
ColmapImage colmap_image(std::uint32_t id, const Eigen::Vector4d& q, const Eigen::Vector3d& t, std::uint32_t camera_id,
                         std::string name);

/// One function for each format.
std::vector<ColmapCamera> read_colmap_cameras_text(const std::filesystem::path& file);
std::vector<ColmapCamera> read_colmap_cameras_binary(const std::filesystem::path& file);
std::vector<ColmapImage> read_colmap_images_text(const std::filesystem::path& file);
std::vector<ColmapImage> read_colmap_images_binary(const std::filesystem::path& file);

}  // namespace esim::inline geometry
