#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// A round dot, smooth at its edge.
struct Dot {
  float x = 0, y = 0;  ///< of its centre, px
  float radius = 1;    ///< px, up to 32
  float depth = 0;     ///< 0 (nearest) to 1 (farthest)
  Rgb colour{};
  std::uint16_t opacity = 0;  ///< 256: hides what is behind it
};

/// Draws dots over a picture from the farthest to the nearest, those of (almost) the same depth in their order. What
/// lies outside is cut off.
void draw_dots(const std::vector<Dot>& dots, Image<Rgb>& picture);

}  // namespace esim
