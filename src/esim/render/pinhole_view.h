#pragma once

#include <vector>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"
#include "esim/render/pixel_rays.h"

namespace esim {

/// Which pinhole images a renderer can draw.
enum class Pinhole {
  any,      ///< of any focal lengths and principal point
  centred,  ///< with square pixels, and the principal point in the middle of the image
};

/// The pinhole image that contains what a camera sees. Where the camera is such a pinhole itself, that is its own;
/// otherwise a wider one, nowhere coarser than the camera's pixels, and where these look in it.
struct PinholeView {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px

  bool looked_up = false;         ///< it is not the camera's own
  std::vector<float> centres;     ///< per pixel of the camera: x, y in the pinhole image, px
  std::vector<float> footprints;  ///< per pixel of the camera: how that changes, dx/du, dx/dv, dy/du, dy/dv

  double horizontal_fov_rad() const;  ///< between its left and right borders, where it is centred

  /// What must be drawn of the pinhole image for a tile of the camera's.
  Tile part_for(const Tile& tile) const;

 private:
  friend PinholeView pinhole_view(const Camera& camera, const PixelRays& rays, Pinhole which);
  int camera_width_ = 0;
};

/// Throws UserError where the view is too wide for a pinhole image.
PinholeView pinhole_view(const Camera& camera, const PixelRays& rays, Pinhole which);

}  // namespace esim
