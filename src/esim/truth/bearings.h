#pragma once

#include <Eigen/Core>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"

namespace esim::inline truth {

/// The bearing (x, y, 1) of each pixel's centre in the camera frame, without the 1. Renderers must accept the camera:
/// its lens must map every pixel to a bearing.
Image<Eigen::Vector2d> bearings_of(const Camera& camera);

}  // namespace esim::inline truth
