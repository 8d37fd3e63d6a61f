#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/sample_store/sample_store.h"

// The bytes of a store: a header, then blocks. The last block has no portions, but the list of the key blocks; the last
// 8 bytes of the file are its offset.
//
// Private to sample_store.
namespace esim::inline sample_store {

inline constexpr std::array<char, 8> kMagic{'e', 's', 'i', 'm', '-', 's', 'm', 'p'};
inline constexpr std::uint32_t kVersion = 2;

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t precision = 0;
  std::int32_t width = 0, height = 0;
  std::int64_t start = 0, end = 0;
};
static_assert(sizeof(Header) == 40);

/// The irradiance of a block is divided into planes: byte k of the differences of all its pixels.
inline constexpr std::size_t kPlanes = 4;

/// Each compressed part is a frame of Zstandard with a checksum.
struct BlockHeader {
  std::uint32_t portions = 0;  ///< 0: the end of a complete store
  std::uint32_t segments = 0;  ///< at the end: key blocks
  std::uint64_t pixels = 0;
  std::uint32_t list_bytes = 0;                      ///< compressed portions and segments, or key blocks
  std::array<std::uint32_t, kPlanes> plane_bytes{};  ///< compressed; 0: all bytes are 0
  std::uint32_t is_key = 0;  ///< 1: differences to irradiances of 0, so that reading can begin here
};
static_assert(sizeof(BlockHeader) == 40);

struct KeyEntry {
  std::int64_t watermark = 0;  ///< before the block; its segments begin then or later
  std::uint64_t offset = 0;
};

/// Simulated time between key blocks, at least. Each adds some 300 kB at 346 x 260 px.
inline constexpr TimeNs kKeyInterval = kNsPerSecond / 2;

struct PortionEntry {
  std::int64_t watermark = 0;
  std::uint64_t segments = 0;
};

struct SegmentEntry {
  std::int64_t t0 = 0, t1 = 0;
  std::uint16_t x = 0, y = 0, width = 0, height = 0;
  std::uint64_t own_start = 0;  ///< 1: the irradiance at t0 is stored, too, before that at t1
};
static_assert(sizeof(SegmentEntry) == 32);

/// Limits of a block (larger ones leave the caches), which bound the memory that a damaged file can request.
inline constexpr std::uint64_t kUsualBlockPixels = std::uint64_t{1} << 19;
inline constexpr std::uint32_t kMaxBlockEntries = std::uint32_t{1} << 20;
inline std::uint64_t max_block_pixels(int width, int height) {
  return kUsualBlockPixels + 4 * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
}

/// The number that stands for an irradiance: its bits without those that are dropped. Rounds to the nearest, half
/// upwards; the carry may increase the exponent.
inline constexpr int kDroppedBits = 23 - kRoundedBits;
inline std::uint32_t code_of(float irradiance, bool rounded) {
  const auto bits = std::bit_cast<std::uint32_t>(irradiance);
  return rounded ? (bits + (1U << (kDroppedBits - 1))) >> kDroppedBits : bits;
}
inline float irradiance_of(std::uint32_t code, int dropped_bits) { return std::bit_cast<float>(code << dropped_bits); }

/// A code as the difference to that of the pixel's previous sample, small for small changes in both
/// directions; the inverse.
inline std::uint32_t difference(std::uint32_t code, std::uint32_t before) {
  const auto d = static_cast<std::int32_t>(code - before);
  return (static_cast<std::uint32_t>(d) << 1) ^ static_cast<std::uint32_t>(d >> 31);
}
inline std::uint32_t undo_difference(std::uint32_t difference, std::uint32_t before) {
  return before + ((difference >> 1) ^ (0U - (difference & 1U)));
}

}  // namespace esim::inline sample_store
