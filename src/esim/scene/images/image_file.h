#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "esim/core/image.h"
#include "esim/scene/planes.h"

namespace esim::inline scene {

/// Reads an image file as linear light, 1.0 = white: R, G and B if `colour`, luminance otherwise. With automatic
/// encoding, 8- and 16-bit files (PNG, JPEG, WebP, PNM) are sRGB; OpenEXR and Radiance HDR files are
/// linear, and keep values above 1. Transparent integer files are composited over white.
/// Throws UserError, naming the file, if it is missing, unreadable, or larger than 2^28 pixels.
void load_planes(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes);

/// As above, for the content of an image file in memory; `name` is for messages. Transparency is ignored. OpenEXR is
/// not supported.
void decode_planes(std::span<const std::byte> content, const std::string& name, Encoding encoding, bool colour,
                   Planes& planes);

/// Filters for noisy or too sharp images.
struct Softening {
  int median_px = 0;       ///< odd side of the square of a median per channel, before decoding; up to 1: no median
  double gaussian_px = 0;  ///< standard deviation of a blur in linear light; 0: no blur
  bool around = false;     ///< the image wraps around from its right to its left edge, like a panorama
};

/// Reads an image file as luminance, with automatic encoding. Also throws UserError for a median of an image that does
/// not have 8 bits, or over an even number of pixels.
Image<float> load_luminance(const std::filesystem::path& path, const Softening& softening = {});

/// As above, in colour: three planes of R, G and B.
Planes load_colours(const std::filesystem::path& path, const Softening& softening = {});

/// An image with transparency.
struct TranslucentImage {
  Image<float> light;  ///< linear luminance times alpha
  Image<float> alpha;  ///< opacity, linear; empty: opaque everywhere
};

/// Reads an image file as luminance, like load_luminance, keeping the transparency of 8- and 16-bit files.
TranslucentImage load_translucent(const std::filesystem::path& path, const Softening& softening = {});

}  // namespace esim::inline scene
