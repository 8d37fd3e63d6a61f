#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/geometry/se3.h"

namespace esim::inline reproject {

/// A frame that another simulator has rendered. All images have the size of KeyframeLayout::camera.
struct PosedFrame {
  TimeNs t = 0;
  SE3 T_world_camera;
  std::vector<SE3> T_world_objects;  ///< of the moving objects; later frames may add objects at the end
  Image<float> irradiance;           ///< mean of E over the area of each pixel; linear, at least 0
  Image<float> depth;                ///< Z, m; infinite or 0 where there is no surface
  Image<std::uint16_t> object;       ///< as in Sample; empty if no object is labelled

  /// The way of the surface point in each pixel since the previous frame, in pixels of this image to the right and
  /// downwards; empty if not known. If given, the motion of objects is found from it instead of T_world_objects.
  Image<float> motion_x, motion_y;
};

}  // namespace esim::inline reproject
