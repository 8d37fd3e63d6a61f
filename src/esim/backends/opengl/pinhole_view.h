#pragma once

#include <array>
#include <vector>

#include "esim/geometry/camera.h"
#include "esim/render/pixel_rays.h"

namespace esim {

/// The pinhole image that contains what a camera sees. Without distortion that is the camera's own; otherwise a wider
/// one, nowhere coarser than the camera's pixels, and where these look in it. Private to the renderer.
struct PinholeView {
  int width = 0, height = 0;
  std::array<float, 4> clip{};  ///< clip coordinates x, y = (clip[0], clip[1]) X, Y + (clip[2], clip[3]) Z

  bool distorts = false;
  std::vector<float> centres;     ///< per pixel of the camera: x, y in the pinhole image, px
  std::vector<float> footprints;  ///< per pixel of the camera: how that changes, dx/du, dx/dv, dy/du, dy/dv

  /// What must be drawn of the pinhole image for a tile of the camera's.
  Tile part_for(const Tile& tile) const;

 private:
  friend PinholeView pinhole_view(const Camera& camera, const PixelRays& rays);
  int camera_width_ = 0;
};

/// Throws UserError where the view is too wide for a pinhole image.
PinholeView pinhole_view(const Camera& camera, const PixelRays& rays);

}  // namespace esim
