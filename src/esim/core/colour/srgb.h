#pragma once

#include <cstdint>

#include "esim/core/image.h"

namespace esim::inline core {

/// The irradiance that this level stands for, in an sRGB encoding with so many bits.
Image<float> decode_srgb(const Image<std::uint16_t>& encoded, int bits);

/// Encodes linear irradiance as 8-bit sRGB (IEC 61966-2-1): 0 and below, and NaN, give 0; 1 and above give 255.
Image<std::uint8_t> encode_srgb(const Image<float>& irradiance);

}  // namespace esim::inline core
