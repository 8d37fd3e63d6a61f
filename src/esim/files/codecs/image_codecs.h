#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "esim/files/image_pixels.h"

namespace esim::inline files {

/// The formats of decode_image, for messages.
inline constexpr const char* kImageFormats = "PNG, JPEG, WebP, Radiance HDR or PNM (PGM, PPM)";

/// Decodes an image file. PNG: 8 or 16 bits; palettes, fewer bits, and grey with alpha become R G B (and alpha). JPEG:
/// grey or R G B, not rotated. WebP: R G B (and alpha). Radiance HDR: R G B in float. PNM: grey or R G B, 8 or 16 bits.
/// False if it is of another format, cut off or damaged, or if its size is implausible for so few bytes. Reuses the
/// memory of `pixels`.
bool decode_image(std::span<const std::byte> file, ImagePixels& pixels);

/// Decodes a JPEG image to R G B, each side reduced by `factor`: 1, 2, 4 or 8. Larger factors are faster. False as
/// above.
bool decode_reduced_jpeg(std::span<const std::byte> file, int factor, ImagePixels& pixels);

/// An image in memory that belongs to the caller, rows from the top, channels interleaved.
struct PixelView {
  const void* data = nullptr;
  std::size_t row_bytes = 0;
  int width = 0, height = 0;
  int channels = 1;  ///< 1: grey, 3: R G B
  int bits = 8;      ///< 8, or 16 in the machine's byte order
};

enum class PngEffort {
  fast,   ///< differences and runs: best for simulated images
  small,  ///< all filters: twice the time; smaller for drawings
};
std::string encode_png(const PixelView& image, PngEffort effort);

/// Of 8 bits. `quality`: 1 to 100.
std::string encode_jpeg(const PixelView& image, int quality);

}  // namespace esim::inline files
