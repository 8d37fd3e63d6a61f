#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace esim {

struct ImageSize {
  std::int64_t width = 0, height = 0;
};

/// The size that a PNG, JPEG, TIFF, BMP or Radiance HDR image says it has, from its first bytes, so that an absurd one
/// can be refused before a decoder takes memory for it. Nothing where the format is another, or the size is not among
/// these bytes.
std::optional<ImageSize> size_in_header(std::span<const std::byte> head);

/// How many bytes of a file are enough for nearly every image.
inline constexpr std::size_t kImageHeadBytes = std::size_t{1} << 20;

}  // namespace esim
