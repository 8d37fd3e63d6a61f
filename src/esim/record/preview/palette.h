#pragma once

#include <array>

#include "esim/core/image.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// A picture of at most 256 colours.
struct PaletteImage {
  Image<std::uint8_t> indices;
  std::array<Rgb, 256> colours{};
};

/// Nearly the same picture with few colours, by median cut (Heckbert, "Color image quantization for frame buffer
/// display", 1982) at 5 bits per component; exact to 8 levels where there are at most 256 different ones. No dithering.
PaletteImage reduce_colours(const Image<Rgb>& image);

}  // namespace esim
