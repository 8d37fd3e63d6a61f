#include "esim/render/pinhole_lookup.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace esim {
namespace {

void copy(const PinholeImage& image, const Tile& tile, Sample& sample) {
  const int end = tile.x + tile.width;
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const auto copy_row = [&](const auto& from, auto& to) {
      std::copy(from.row(y) + tile.x, from.row(y) + end, to.row(y) + tile.x);
    };
    copy_row(image.irradiance, sample.irradiance);
    copy_row(image.depth, sample.depth);
    if (!sample.object.empty() && !image.object.empty()) copy_row(image.object, sample.object);
  }
}

/// Between the four pixels around a place.
float interpolate(const Image<float>& image, float x, float y) {
  const int left = std::clamp(static_cast<int>(x), 0, image.width() - 2);
  const int top = std::clamp(static_cast<int>(y), 0, image.height() - 2);
  const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
  const float *const upper = image.row(top) + left, *const lower = image.row(top + 1) + left;
  const float above = upper[0] + fx * (upper[1] - upper[0]), below = lower[0] + fx * (lower[1] - lower[0]);
  return above + fy * (below - above);
}

float nearness(const Image<float>& depth, int x, int y) { return 1.0F / depth(x, y); }

/// Of nearness, along a direction; of the two sides the one that is more likely on the same surface.
float slope(const Image<float>& depth, int x, int y, int dx, int dy) {
  const float here = nearness(depth, x, y);
  const float before = here - nearness(depth, x - dx, y - dy), after = nearness(depth, x + dx, y + dy) - here;
  return std::fabs(before) < std::fabs(after) ? before : after;
}

}  // namespace

void look_up(const PinholeView& view, const PinholeImage& image, const Tile& tile, Sample& sample) {
  if (!view.looked_up) return copy(image, tile, sample);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(sample.depth.width()) + static_cast<std::size_t>(x);
      const float cx = view.centres[2 * pixel], cy = view.centres[2 * pixel + 1];
      const float* const footprint = &view.footprints[4 * pixel];
      const float right_x = 0.25F * footprint[0], down_x = 0.25F * footprint[1];
      const float right_y = 0.25F * footprint[2], down_y = 0.25F * footprint[3];
      float sum = 0;
      for (const float a : {-1.0F, 1.0F}) {
        for (const float b : {-1.0F, 1.0F})
          sum += interpolate(image.irradiance, cx + a * right_x + b * down_x, cy + a * right_y + b * down_y);
      }
      sample.irradiance(x, y) = 0.25F * sum;

      const int i = std::clamp(static_cast<int>(std::lround(cx)), 1, image.depth.width() - 2);
      const int j = std::clamp(static_cast<int>(std::lround(cy)), 1, image.depth.height() - 2);
      const float nearest = nearness(image.depth, i, j) +
                            (cx - static_cast<float>(i)) * slope(image.depth, i, j, 1, 0) +
                            (cy - static_cast<float>(j)) * slope(image.depth, i, j, 0, 1);
      sample.depth(x, y) = nearest > 0 ? 1.0F / nearest : std::numeric_limits<float>::infinity();
      if (!sample.object.empty() && !image.object.empty()) sample.object(x, y) = image.object(i, j);
    }
  }
}

}  // namespace esim
