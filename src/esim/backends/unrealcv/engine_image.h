#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "esim/core/image.h"
#include "esim/render/pinhole_lookup.h"

/// Images in answers of UnrealCV: a PNG or NPY file each. Whatever is wrong with them is an EngineError that says what
/// they are, as the end of a sentence, and names neither address nor command.
namespace esim {

/// An image that is whole, but of another size than was set.
struct OtherSize {
  std::uint64_t width = 0, height = 0;
};

/// Size of the image that is expected.
struct ImageExtent {
  int width = 0, height = 0;
};

bool is_npy(std::string_view body);
bool is_png(std::string_view body);

/// Luminance in linear light. PNG and bytes in NPY are sRGB, R first; floating-point numbers are linear; alpha is
/// ignored. What is negative becomes 0. Throws OtherSize as well, also below.
void decode_light(std::string_view body, ImageExtent expected, Image<float>& irradiance);

/// The first channel of floating-point numbers, as they are. +inf stays; numbers that are none, or negative, are
/// errors.
void decode_depth(std::string_view body, ImageExtent expected, Image<float>& depth);

/// i + 1 where a pixel has the i-th of `codes`, 0 otherwise. The code of a colour is R + 256 G + 65536 B; NPY may hold
/// codes as such.
void decode_mask(std::string_view body, ImageExtent expected, const std::vector<std::uint32_t>& codes,
                 Image<std::uint16_t>& object);

/// The code in "(R=255,G=0,B=127,A=255)", or in "255 0 127"; throws EngineError where there is none.
std::uint32_t colour_code(std::string_view text);

}  // namespace esim
