#pragma once

#include <cstdint>

#include "esim/core/image.h"
#include "esim/render/pinhole_view.h"
#include "esim/render/sample.h"

namespace esim {

/// What a pinhole camera sees, from a renderer that knows no other.
struct PinholeImage {
  Image<float> irradiance;      ///< E, linear
  Image<float> depth;           ///< Z, planar, m; +inf: nothing
  Image<std::uint16_t> object;  ///< as in Sample; without size where nobody asked
};

// For a tile of the camera's pixels, from the image that `view` describes. Where that is not the camera's own, it is
// looked up in.

/// Fills E: the mean of four places in the pixel's footprint, each between four pixels: blurred by less than a pixel.
void look_up_light(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample);

/// Fills Z and, where the sample has room for it, the object. Z follows from the plane that the nearest pixel sees, on
/// which 1 / Z is linear: exact away from edges. The object is that of the nearest pixel.
void look_up_geometry(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample);

}  // namespace esim
