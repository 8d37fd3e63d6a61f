#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace esim::ros {

/// How chunks of messages are packed.
enum class ChunkCodec { none, lz4, zstd, bz2 };

/// More than this, in bytes, is in no chunk and in no message: what a damaged file claims is not trusted with memory.
inline constexpr std::uint64_t kMaxChunkBytes = 1U << 28;

/// Replaces `packed`. LZ4 is in its frame format, of independent blocks with a checksum of the content: what ROS 1
/// reads. Not for bz2, which is only read.
void compress(ChunkCodec codec, std::string_view raw, std::string& packed);

/// What was packed: `packed` itself, or what it becomes in `buffer`. Throws Malformed unless it is exactly `size`
/// bytes, and kMaxChunkBytes at most. Takes no more memory than twice what is really there.
std::span<const std::byte> decompress(ChunkCodec codec, std::span<const std::byte> packed, std::uint64_t size,
                                      std::vector<std::byte>& buffer);

}  // namespace esim::ros
