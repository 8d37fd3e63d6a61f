#pragma once

#include <cstdint>
#include <filesystem>

#include "esim/core/image.h"

namespace esim {

/// Writes a grey PNG of 8 or 16 bits, compressed a little and fast. Throws OutputError where that fails.
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image);
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image);

/// Likewise a colour PNG of an RGGB mosaic (see colour_at): a pixel keeps the number of its own colour, and takes those
/// of the other two from its neighbours, along edges.
void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint8_t>& mosaic);
void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint16_t>& mosaic);

}  // namespace esim
