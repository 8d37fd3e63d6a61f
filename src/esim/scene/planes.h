#pragma once

#include <cstddef>
#include <vector>

#include "esim/core/image.h"

namespace esim::inline scene {

/// An image in linear light, 1.0 = white: one plane of luminance (Rec. 709: 0.2126 R + 0.7152 G + 0.0722 B), or three
/// of R, G and B.
using Planes = std::vector<Image<float>>;

/// How the codes of an image or a video represent light.
enum class Encoding {
  automatic,  ///< integers as sRGB, floating point as linear, unless the file specifies it
  srgb,       ///< the transfer function of IEC 61966-2-1
  linear,
};

enum class PixelType { uint8, uint16, float32 };

/// Pixels in a decoder's memory, borrowed.
struct CodedImage {
  const void* data = nullptr;
  std::ptrdiff_t row_bytes = 0;
  int width = 0, height = 0;
  int channels = 1;     ///< 1: grey, 2: grey and alpha, 3: colour, 4: colour and alpha
  bool opaque = false;  ///< ignore alpha
  PixelType type = PixelType::uint8;
};

/// Decodes to three planes if `colour`, and to luminance otherwise. Grey values stay exact; transparency is composited
/// over white. Planes of the right size are reused.
void decode(const CodedImage& image, Encoding encoding, bool colour, Planes& planes);

/// Luminance of R, G and B; if they are equal, exactly their value.
constexpr float luminance(float red, float green, float blue) {
  return green + 0.2126F * (red - green) + 0.0722F * (blue - green);
}

/// Resizes `planes` to one or three planes of a size; keeps the memory if they already have it.
void resize(Planes& planes, int width, int height, bool colour);

/// Inverse of the sRGB transfer function (IEC 61966-2-1), for values from 0 on; it continues above 1.
float linear_from_srgb(float encoded);

/// The sRGB transfer function, for values from 0 on; it continues above 1.
float srgb_from_linear(float linear);

}  // namespace esim::inline scene
