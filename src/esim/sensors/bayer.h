#pragma once

#include "esim/core/image.h"

namespace esim {

/// What the pixels of a sensor with colour filters see of an image, all planes of one size and linear. The filters are
/// RGGB: red where column and row are even, blue where both are odd, green elsewhere.
void mosaic(const Image<float>& red, const Image<float>& green, const Image<float>& blue, Image<float>& out);

}  // namespace esim
