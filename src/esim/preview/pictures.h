#pragma once

#include <string>

#include "esim/core/image.h"
#include "esim/plot/colour.h"

namespace esim::inline preview {

/// Mean over the source pixels that each target pixel covers; the target must not be larger than the source.
Image<float> reduce_mean(const Image<float>& image, int width, int height);

/// The source pixel nearest to the centre of each target pixel; without interpolation, so that edges and infinities
/// remain.
Image<float> reduce_nearest(const Image<float>& image, int width, int height);

/// Enlarges by repeating pixels; with fractional factors, borders between pixels are blended.
Image<Rgb> enlarge(const Image<Rgb>& image, int width, int height);

/// Encodes an 8-bit colour PNG file.
std::string encode_png(const Image<Rgb>& image);

}  // namespace esim::inline preview
