#pragma once

#include <Eigen/Core>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"

namespace esim {

/// Of each pixel's centre the bearing (x, y, 1) in the camera frame, without the 1. The camera is one that renderers
/// accept: its lens shows something at every pixel.
Image<Eigen::Vector2d> bearings_of(const Camera& camera);

}  // namespace esim
