#pragma once

#include <cstdint>

#include "esim/core/image.h"
#include "esim/render/pinhole_view.h"
#include "esim/render/sample.h"

namespace esim::inline render {

/// What a pinhole camera sees, from a renderer that supports no other camera.
struct PinholeImage {
  Image<float> irradiance;      ///< E, linear
  Image<float> depth;           ///< Z, planar, m; +inf where no surface is seen
  Image<std::uint16_t> object;  ///< as in Sample; empty if not requested
};

// These fill a tile of the camera's pixels from the image that `view` describes. If that is not the camera's own image,
// they look up each pixel in it.

/// Fills E: the mean of four bilinear samples in the pixel's footprint, which blurs by less than a pixel.
void look_up_light(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample);

/// Fills Z and, if the sample has space for it, the object. Z follows from the plane that the nearest pixel sees, on
/// which 1 / Z is linear; it is exact away from edges. The object is that of the nearest pixel.
void look_up_geometry(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample);

}  // namespace esim::inline render
