#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace esim::inline scene {

struct ImageSize {
  std::int64_t width = 0, height = 0;
};

/// The size in the header of a PNG, JPEG, WebP or Radiance HDR image, from its first bytes, so that an absurd size
/// can be rejected before a decoder allocates memory. Empty for other formats, or if these bytes do not contain the
/// size.
std::optional<ImageSize> size_in_header(std::span<const std::byte> head);

/// Number of bytes that is enough for nearly every image.
inline constexpr std::size_t kImageHeadBytes = std::size_t{1} << 20;

}  // namespace esim::inline scene
