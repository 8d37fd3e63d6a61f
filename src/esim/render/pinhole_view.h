#pragma once

#include <vector>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"
#include "esim/render/pixel_rays.h"

namespace esim::inline render {

/// Which pinhole images a renderer can draw.
enum class Pinhole {
  any,      ///< with any focal lengths and principal point
  centred,  ///< with square pixels, and the principal point in the middle of the image
};

/// The pinhole image that contains what a camera sees. If the camera is such a pinhole, this is its own image;
/// otherwise it is a wider image, nowhere coarser than the camera's pixels, with the position of each pixel in it.
struct PinholeView {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px

  bool looked_up = false;         ///< true if it is not the camera's own image
  std::vector<float> centres;     ///< per pixel of the camera: x, y in the pinhole image, px
  std::vector<float> footprints;  ///< per pixel of the camera: derivatives of its centre, dx/du, dx/dv, dy/du, dy/dv

  double horizontal_fov_rad() const;  ///< between its left and right borders, if it is centred

  /// The part of the pinhole image that a tile of the camera's image needs.
  Tile part_for(const Tile& tile) const;

 private:
  friend PinholeView pinhole_view(const Camera& camera, const PixelRays& rays, Pinhole which);
  int camera_width_ = 0;
};

/// Throws UserError if the field of view is too wide for a pinhole image.
PinholeView pinhole_view(const Camera& camera, const PixelRays& rays, Pinhole which);

}  // namespace esim::inline render
