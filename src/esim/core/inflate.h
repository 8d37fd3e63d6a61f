#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace esim {

/// Bytes behind the input and the output of inflate_zlib() that it may read and overwrite.
inline constexpr std::size_t kInflateMargin = 320;

/// Fills `out`, whose size must be that of the data, from a zlib stream (RFC 1950, 1951), and verifies the checksum.
/// Both spans must be followed by kInflateMargin bytes of the caller's memory, with any content; those behind `out` are
/// overwritten. False where the stream is damaged or needs a preset dictionary.
///
/// Made for images, whose noise is short codes of literals: up to three of them are found in one look, where other
/// decoders wait for each.
bool inflate_zlib(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out);

}  // namespace esim
