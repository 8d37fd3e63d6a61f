#include "esim/reproject/cells.h"

#include <algorithm>
#include <limits>

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
  workers_.for_each(height, [&](int y) { look_at_row(y, moves, pixels); });
}

/// The surfaces at the centres of the pixels of a row, and the first edge found in the cells of each.
void Cells::look_at_row(int y, bool moves, VisibleSurface& pixels) const {
  const int width = pixels.nearness.width(), s = s_;
  const int around = 2 - s % 2, begin = (s - around) / 2;  // without a central cell, cells meet at the centre
  float* const nearest = pixels.nearness.row(y);
  Edge* const edge = pixels.edge.row(y);
  std::vector<float> lowest_at(static_cast<std::size_t>(width), std::numeric_limits<float>::infinity()),
      sum_at(lowest_at.size());
  float *const lowest = lowest_at.data(), *const sum = sum_at.data();
  std::fill_n(nearest, width, VisibleSurface::kNothing);
  std::fill_n(edge, width, Edge::none);
  for (int cell = 0; cell < around * around; ++cell) {
    const float* const cells = cells_.nearness.row(s * y + begin + cell / around) + begin + cell % around;
#pragma omp simd
    for (int x = 0; x < width; ++x) {
      const float here = cells[s * x];
      nearest[x] = std::max(nearest[x], here), lowest[x] = std::min(lowest[x], here), sum[x] += here;
    }
  }
  for (int cell = 0; cell < s * s; ++cell) {
    const Edge* const cells = cells_.edge.row(s * y + cell / s) + cell % s;
#pragma omp simd
    for (int x = 0; x < width; ++x) edge[x] = edge[x] != Edge::none ? edge[x] : cells[s * x];
  }
  const float share = 1.0F / static_cast<float>(around * around);
#pragma omp simd
  for (int x = 0; x < width; ++x) nearest[x] = lowest[x] > (1 - kOneSurface) * nearest[x] ? share * sum[x] : nearest[x];

  for (int x = 0; x < width; ++x) {
    if (!moves && nearest[x] >= 0) continue;
    Seen seen = nearest_of(s * x + begin, s * y + begin, around);
    if (seen.nearness < 0) {
      seen = nearest_of(s * x, s * y, s);
      nearest[x] = seen.nearness;
    }
    if (moves) pixels.part(x, y) = seen.part;
  }
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

}  // namespace esim::inline reproject
