#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace esim::inline formats::ros {

/// Compression of chunks of messages.
enum class ChunkCodec { none, lz4, zstd, bz2 };

/// The maximum size of chunks and messages, bytes. Damaged files that claim more do not allocate memory.
inline constexpr std::uint64_t kMaxChunkBytes = 1U << 28;

/// The compressed data: `raw` itself, or `buffer`. LZ4 uses its frame format, with independent blocks and a checksum of
/// the content, which ROS 1 can read. Not for bz2, which is read only.
std::string_view compress(ChunkCodec codec, std::string_view raw, std::string& buffer);

/// The uncompressed data: `packed` itself, or `buffer`. Throws Malformed unless they have exactly `size` bytes, at most
/// kMaxChunkBytes. Allocates at most twice the size of the actual data.
std::span<const std::byte> decompress(ChunkCodec codec, std::span<const std::byte> packed, std::uint64_t size,
                                      std::vector<std::byte>& buffer);

}  // namespace esim::inline formats::ros
