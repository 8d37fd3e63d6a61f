#pragma once

#include <array>
#include <cstdint>

#include "esim/core/image.h"

namespace esim {

/// What an image shows at a pixel, as far as depth tells.
enum class Place : std::uint8_t {
  surface,     ///< smooth
  crease,      ///< where a surface is bent
  near_edge,   ///< the eight pixels around those of the next
  depth_edge,  ///< on either side of an edge behind which something else is seen
};

inline constexpr std::array<const char*, 4> kPlaceNames = {"surface", "crease", "near a depth edge", "depth edge"};

/// The place of each pixel of a depth image (Z, m; infinite for nothing) of a camera with that focal length. On a plane
/// 1/Z is linear in the image, whatever its slant: a crease is where the slope of 1/Z changes by more than turning by
/// about 20 degrees does, an edge where 1/Z changes by more than 1 % and by thrice of what it does on both sides.
Image<Place> places_of(const Image<float>& depth, double focal_px);

}  // namespace esim
