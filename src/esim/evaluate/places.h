#pragma once

#include <array>
#include <cstdint>

#include "esim/core/image.h"

namespace esim::inline evaluate {

/// What an image shows at a pixel, judged by depth.
enum class Place : std::uint8_t {
  surface,     ///< smooth
  crease,      ///< where a surface is bent
  near_edge,   ///< the eight pixels around each depth_edge pixel
  depth_edge,  ///< on both sides of a depth discontinuity
};

inline constexpr std::array<const char*, 4> kPlaceNames = {"surface", "crease", "near a depth edge", "depth edge"};

/// The place of each pixel of a depth image (Z, m; infinite without a surface) of a camera with this focal length. On a
/// plane 1/Z is linear in the image, whatever its slant. A crease is where the slope of 1/Z changes by more than at a
/// bend of about 20 degrees. An edge is where 1/Z changes by more than 1 % and by more than three times its changes on
/// both sides.
Image<Place> places_of(const Image<float>& depth, double focal_px);

}  // namespace esim::inline evaluate
