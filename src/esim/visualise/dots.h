#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/preview/colours.h"

namespace esim::inline visualise {

/// A round dot, smooth at its edge.
struct Dot {
  float x = 0, y = 0;  ///< centre, px
  float radius = 1;    ///< px, up to 32
  float depth = 0;     ///< 0 (nearest) to 1 (farthest)
  Rgb colour{};
  std::uint16_t opacity = 0;  ///< 256: opaque
};

/// Draws dots onto an image from the farthest to the nearest, those of (almost) the same depth in their order. Dots are
/// clipped to the image.
void draw_dots(const std::vector<Dot>& dots, Image<Rgb>& picture);

}  // namespace esim::inline visualise
