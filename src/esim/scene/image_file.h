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

/// The same as luminance, with automatic encoding.
Image<float> load_luminance(const std::filesystem::path& path);

}  // namespace esim
