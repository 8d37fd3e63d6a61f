#pragma once

#include <array>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline preview {

/// An image with at most 256 colours.
struct PaletteImage {
  Image<std::uint8_t> indices;
  std::array<Rgb, 256> colours{};
};

/// Reduces the colours of an image by median cut (Heckbert, "Color image quantization for frame buffer display", 1982)
/// at 5 bits per component; exact to 8 levels for images with at most 256 colours. No dithering.
PaletteImage reduce_colours(const Image<Rgb>& image);

}  // namespace esim::inline preview
