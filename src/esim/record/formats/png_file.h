#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/colour.h"
#include "esim/core/image.h"

namespace esim {

/// Writes a grey PNG of 8 or 16 bits, compressed a little and fast. Throws OutputError where that fails.
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image);
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image);

/// Likewise a colour PNG of an RGGB mosaic (see colour_at): a pixel keeps the number of its own colour, and takes those
/// of the other two from its neighbours, along edges.
void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint8_t>& mosaic);
void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint16_t>& mosaic);

/// Writes a colour PNG of 16 bits, its channels of the same size.
void write_png(const std::filesystem::path& path, const PerColour<Image<std::uint16_t>>& channels);

/// What a PNG holds: one channel, or red, green and blue.
struct PngImage {
  int bits = 8;  ///< 8 or 16
  std::vector<Image<std::uint16_t>> channels{};
};

/// Reads a PNG without an alpha channel. What the file says of its size is not trusted: memory is taken only for what
/// its bytes can hold. Throws UserError that names the file.
PngImage read_png(const std::filesystem::path& path);

/// The bytes of a grey PNG, of 8 bits or, where `bits` are more, 16.
std::string encode_png(const Image<std::uint16_t>& image, int bits);

/// The one channel of a PNG in memory; colours become grey. Nothing where it is none, damaged, or claims to be larger
/// than its bytes can tell of.
std::optional<PngImage> decode_grey_png(std::string_view bytes);

}  // namespace esim
