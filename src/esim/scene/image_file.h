#pragma once

#include <filesystem>

#include "esim/core/image.h"

namespace esim {

/// Reads an image file as linear luminance (Rec. 709: 0.2126 R + 0.7152 G + 0.0722 B), 1.0 = white.
/// 8- and 16-bit files (PNG, JPEG, TIFF, ...) are taken as sRGB-encoded and linearised; OpenEXR and Radiance HDR
/// files are linear already and keep values above 1. Transparency is laid over white.
/// Throws UserError naming the file when it is missing, unreadable, or larger than 2^28 pixels.
Image<float> load_luminance(const std::filesystem::path& path);

/// Inverse of the sRGB transfer function (IEC 61966-2-1), for values on [0, 1].
float linear_from_srgb(float encoded);

}  // namespace esim
