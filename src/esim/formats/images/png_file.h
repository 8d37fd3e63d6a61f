#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "esim/core/colour/colour.h"
#include "esim/core/image.h"

namespace esim::inline formats {

/// Writes a grey PNG of 8 or 16 bits, with fast compression. Throws OutputError on failure.
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image);
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image);

/// The same for a colour PNG from an RGGB mosaic (see colour_at): a pixel keeps the number of its own colour; the other
/// two are interpolated from its neighbours, along edges.
void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint8_t>& mosaic);
void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint16_t>& mosaic);

/// Writes a colour PNG of 16 bits, its channels of the same size.
void write_png(const std::filesystem::path& path, const PerColour<Image<std::uint16_t>>& channels);

/// The contents of a PNG: one channel, or red, green and blue.
struct PngImage {
  int bits = 8;  ///< 8 or 16
  std::vector<Image<std::uint16_t>> channels{};
};

/// Reads a PNG without an alpha channel. Allocates memory only for sizes that its bytes can hold. Throws UserError that
/// names the file.
PngImage read_png(const std::filesystem::path& path);

/// Encodes a grey PNG of 8 bits, or of 16 if `bits` is larger than 8.
std::string encode_png(const Image<std::uint16_t>& image, int bits);

/// Decodes a PNG in memory to one channel; colour becomes grey. Nothing if the bytes are not a PNG, are damaged, or
/// state a size that they cannot hold.
std::optional<PngImage> decode_grey_png(std::string_view bytes);

}  // namespace esim::inline formats
