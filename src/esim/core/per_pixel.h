#pragma once

#include <array>
#include <cstddef>

// Blocks of pixels that are processed in vectors.
namespace esim::inline core {

/// Arrays that are processed in whole vectors have room for one more vector.
inline constexpr std::size_t kVectorPadding = 16;

/// Pixels that are processed together: enough for vectors, few enough for the first-level cache.
inline constexpr std::size_t kBlock = 256;

template <typename T>
using PerPixel = std::array<T, kBlock + kVectorPadding>;

}  // namespace esim::inline core
