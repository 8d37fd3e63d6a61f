#pragma once

#include <cstdint>
#include <functional>

#include "esim/core/image.h"

struct _cairo;

namespace esim::inline plot {

/// How much of each pixel of `box` is covered by what `draw` draws with Cairo, 0 to 255. Drawing is in coordinates of
/// edges: pixel (x, y) extends from (x, y) to (x + 1, y + 1).
Image<std::uint8_t> cover(const Tile& box, const std::function<void(_cairo* context)>& draw);

/// The common part of two tiles; empty if they do not overlap.
Tile intersect(const Tile& a, const Tile& b);

}  // namespace esim::inline plot
