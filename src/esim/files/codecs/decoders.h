#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "esim/files/image_pixels.h"

// Private to files: the decoders of decode_image, which return false as it does.
namespace esim::inline files {

/// Whether a file of so many bytes can hold an image of this size: no compression saves more.
inline bool is_plausible(std::uint64_t width, std::uint64_t height, std::size_t bytes) {
  constexpr std::uint64_t kMaxSide = 1U << 28, kMaxPixels = 1U << 28, kSmall = 1U << 20, kMaxPixelsPerByte = 10'000;
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) return false;
  const std::uint64_t pixels = width * height;
  return pixels <= kMaxPixels && (pixels <= kSmall || pixels <= kMaxPixelsPerByte * bytes);
}

bool decode_png(std::span<const std::byte> file, ImagePixels& pixels);
bool decode_jpeg(std::span<const std::byte> file, ImagePixels& pixels);
bool decode_webp(std::span<const std::byte> file, ImagePixels& pixels);
bool decode_radiance(std::span<const std::byte> file, ImagePixels& pixels);
bool decode_portable_map(std::span<const std::byte> file, ImagePixels& pixels);

}  // namespace esim::inline files
