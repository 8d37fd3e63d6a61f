#pragma once

#include "esim/core/image.h"

namespace esim {

/// What the pixels of a sensor with RGGB filters (see colour_at) see of an image, all planes of one size and linear.
void mosaic(const Image<float>& red, const Image<float>& green, const Image<float>& blue, Image<float>& out);

}  // namespace esim
