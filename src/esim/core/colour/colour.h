#pragma once

#include <array>
#include <cstddef>

namespace esim::inline core {

/// The colour filters of a sensor's pixels.
enum class ColourFilters {
  none,  ///< every pixel sees luminance
  rggb,  ///< Bayer mosaic: every pixel sees the colour_at() its position
};

/// A value each for red, green and blue, in this order.
template <typename T>
using PerColour = std::array<T, 3>;

/// Which colour a pixel sees behind RGGB filters: red (0) where column and row are even, blue (2) where both are odd,
/// green (1) elsewhere.
constexpr std::size_t colour_at(int x, int y) { return static_cast<std::size_t>((x & 1) + (y & 1)); }

}  // namespace esim::inline core
