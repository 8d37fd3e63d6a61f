#include "esim/reproject/cells.h"

#include <algorithm>

namespace esim::inline reproject {
namespace {

// Cells around a pixel's centre see the same surface if their nearness differs by at most this fraction.
constexpr float kOneSurface = 0.05F;

}  // namespace

Cells::Cells(const KeyframeLayout& layout, double greatest_radius, const Workers& workers)
    : s_(layout.supersampling),
      workers_(workers),
      splat_(denser(layout.sensor, layout.supersampling, 0), 1, greatest_radius, workers) {}

void Cells::look(const std::vector<SeenPoints>& keyframes, bool moves, VisibleSurface& pixels) {
  splat_.splat(keyframes, moves, cells_);
  const int width = cells_.nearness.width() / s_, height = cells_.nearness.height() / s_;
  pixels.resize(width, height, moves);
  workers_.for_each(height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const Seen seen = at_centre(x, y);
      pixels.nearness(x, y) = seen.nearness;
      if (moves) pixels.part(x, y) = seen.part;
      pixels.edge(x, y) = edge_in(x, y);
    }
  });
}

/// The surface at the centre of pixel (x, y), or the nearest surface in the pixel if no point falls on the centre.
Cells::Seen Cells::at_centre(int x, int y) const {
  const int left = s_ * x, top = s_ * y;
  const int around = 2 - s_ % 2;  // without a central cell, cells meet at the centre
  const int i = left + (s_ - around) / 2, j = top + (s_ - around) / 2;
  Seen seen = nearest_of(i, j, around);
  if (seen.nearness < 0) return nearest_of(left, top, s_);
  if (around == 1) return seen;
  const float a = cells_.nearness(i, j), b = cells_.nearness(i + 1, j), c = cells_.nearness(i, j + 1),
              d = cells_.nearness(i + 1, j + 1);
  if (std::min({a, b, c, d}) > (1 - kOneSurface) * seen.nearness) seen.nearness = 0.25F * (a + b + c + d);
  return seen;
}

/// The nearest surface in a square of cells.
Cells::Seen Cells::nearest_of(int left, int top, int width) const {
  Seen nearest;
  for (int j = top; j < top + width; ++j) {
    for (int i = left; i < left + width; ++i) {
      if (cells_.nearness(i, j) > nearest.nearness) nearest = at(i, j);
    }
  }
  return nearest;
}

/// The first edge found in the pixel's cells.
Edge Cells::edge_in(int x, int y) const {
  for (int j = y * s_; j < (y + 1) * s_; ++j)
    for (int i = x * s_; i < (x + 1) * s_; ++i)
      if (cells_.edge(i, j) != Edge::none) return cells_.edge(i, j);
  return Edge::none;
}

}  // namespace esim::inline reproject
