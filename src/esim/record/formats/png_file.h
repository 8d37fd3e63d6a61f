#pragma once

#include <cstdint>
#include <filesystem>

#include "esim/core/image.h"

namespace esim {

/// Writes a grey PNG of 8 or 16 bits, compressed a little and fast. Throws OutputError where that fails.
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image);
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image);

}  // namespace esim
