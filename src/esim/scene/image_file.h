#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "esim/core/image.h"
#include "esim/scene/planes.h"

namespace esim {

/// Reads an image file as linear light, 1.0 = white: R, G and B if `colour`, luminance otherwise. With automatic
/// encoding, 8- and 16-bit files (PNG, JPEG, TIFF, ...) are sRGB; OpenEXR, Radiance HDR and other floating-point files
/// are linear, and keep values above 1. Transparency of integer files is laid over white.
/// Throws UserError naming the file when it is missing, unreadable, or larger than 2^28 pixels.
void load_planes(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes);

/// The same of the content of an image file, held in memory; `name` is for messages. Transparency is ignored. OpenEXR
/// is not among the formats.
void decode_planes(std::span<const std::byte> content, const std::string& name, Encoding encoding, bool colour,
                   Planes& planes);

/// Filters for an image that is noisy or too sharp.
struct Softening {
  int median_px = 0;       ///< side of a square, odd: each channel's median over it, before decoding; up to 1: none
  double gaussian_px = 0;  ///< standard deviation of a blur of the light; 0: none
  bool around = false;     ///< the image goes on at its left edge where it ends at the right, as a panorama does
};

/// The same as luminance, with automatic encoding. Throws UserError as well for a median of an image that is not of
/// 8 bits, or over an even number of pixels.
Image<float> load_luminance(const std::filesystem::path& path, const Softening& softening = {});

/// The same in colour: three planes of R, G and B.
Planes load_colours(const std::filesystem::path& path, const Softening& softening = {});

/// An image that lets through what is behind it.
struct TranslucentImage {
  Image<float> light;  ///< linear luminance times alpha
  Image<float> alpha;  ///< share of what is behind that is covered, linear; empty: all of it, everywhere
};

/// Reads an image file as luminance, like load_luminance, keeping the transparency of 8- and 16-bit files.
TranslucentImage load_translucent(const std::filesystem::path& path, const Softening& softening = {});

}  // namespace esim
