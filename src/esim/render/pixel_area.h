#pragma once

namespace esim::inline render {

/// The squares over which a renderer averages around the centre of each pixel; px along each side. In an image that is
/// denser than the sensor's, they may be larger than a pixel.
struct PixelArea {
  double texture = 1;  ///< for textures
  double edges = 1;    ///< for edges; at most `texture`
};

}  // namespace esim::inline render
