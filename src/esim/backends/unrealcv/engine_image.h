#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "esim/core/image.h"
#include "esim/render/pinhole_lookup.h"

// Private to backends/unrealcv.
/// Images in answers of UnrealCV, as PNG or NPY files. Errors are EngineErrors whose message is the end of a sentence
/// about the image, without the address and the command.
namespace esim::inline backends::inline unrealcv {

/// A complete image with another size than was set.
struct OtherSize {
  std::uint64_t width = 0, height = 0;
};

/// The expected size of an image.
struct ImageExtent {
  int width = 0, height = 0;
};

bool is_npy(std::string_view body);
bool is_png(std::string_view body);

/// Luminance in linear light. PNG and bytes in NPY are sRGB, R first; floating-point numbers are linear; alpha is
/// ignored. Negative values become 0. This and the following functions also throw OtherSize.
void decode_light(std::string_view body, ImageExtent expected, Image<float>& irradiance);

/// The first channel of floating-point numbers, unchanged. +inf is allowed; NaN and negative numbers are errors.
void decode_depth(std::string_view body, ImageExtent expected, Image<float>& depth);

/// i + 1 if a pixel has the i-th of `codes`, 0 otherwise. The code of a colour is R + 256 G + 65536 B; NPY may contain
/// the codes themselves.
void decode_mask(std::string_view body, ImageExtent expected, const std::vector<std::uint32_t>& codes,
                 Image<std::uint16_t>& object);

/// The code in "(R=255,G=0,B=127,A=255)", or in "255 0 127"; throws EngineError for other text.
std::uint32_t colour_code(std::string_view text);

}  // namespace esim::inline backends::inline unrealcv
