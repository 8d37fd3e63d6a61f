#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

// Private to core.
namespace esim::inline core {

/// Updates the state of SHA-256 by `count` blocks of 64 bytes.
using Sha256Blocks = void (*)(std::array<std::uint32_t, 8>& state, const std::byte* blocks, std::size_t count);

/// For every processor.
void portable_sha256_blocks(std::array<std::uint32_t, 8>& state, const std::byte* blocks, std::size_t count);

/// The same, by the instructions of this processor if it has them.
Sha256Blocks fastest_sha256_blocks();

}  // namespace esim::inline core
