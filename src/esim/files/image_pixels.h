#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace esim::inline files {

/// The numbers in an image, rows from the top, channels interleaved.
struct ImagePixels {
  int width = 0, height = 0;
  int channels = 0;  ///< 1: grey, 2: grey and alpha, 3: R G B, 4: R G B and alpha
  int bits = 0;      ///< per number: 8, 16 in the machine's byte order, or 32 for float
  std::size_t row_bytes = 0;
  std::vector<std::uint8_t> bytes;

  const std::uint8_t* row(int y) const { return bytes.data() + static_cast<std::size_t>(y) * row_bytes; }
  std::uint8_t* row(int y) { return bytes.data() + static_cast<std::size_t>(y) * row_bytes; }

  /// Rows without padding; the numbers are undefined.
  void resize(int new_width, int new_height, int new_channels, int new_bits) {
    width = new_width, height = new_height, channels = new_channels, bits = new_bits;
    row_bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels * bits / 8);
    bytes.resize(row_bytes * static_cast<std::size_t>(height));
  }
};

}  // namespace esim::inline files
