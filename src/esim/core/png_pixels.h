#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace esim {

/// The numbers in a PNG image, rows from the top, channels of a pixel side by side.
struct PngPixels {
  int width = 0, height = 0;
  int channels = 0;  ///< 1: grey, 2: grey and alpha, 3: R G B, 4: R G B and alpha
  int bits = 0;      ///< of a number: 8, or 16 in the machine's byte order
  std::size_t row_bytes = 0;
  std::vector<std::uint8_t> bytes;

  const std::uint8_t* row(int y) const { return bytes.data() + static_cast<std::size_t>(y) * row_bytes; }
};

/// Decodes a PNG image of the kinds that cameras and renderers write: 8 or 16 bits, without palette, interlacing and
/// transparent colour. False where it is of another kind, or damaged anywhere: checksums are verified, and no more
/// memory is taken than what is there can fill. Several times faster than libpng. Memory of `pixels` is used again.
bool decode_png_pixels(std::span<const std::byte> file, PngPixels& pixels);

}  // namespace esim
