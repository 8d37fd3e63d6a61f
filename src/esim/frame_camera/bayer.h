#pragma once

#include "esim/core/image.h"

namespace esim::inline frame_camera {

/// The mosaic that a sensor with RGGB filters (see colour_at) sees of an image. All planes are linear and of one size.
void mosaic(const Image<float>& red, const Image<float>& green, const Image<float>& blue, Image<float>& out);

}  // namespace esim::inline frame_camera
