#include "esim/evaluate/places.h"

#include <algorithm>
#include <cmath>

namespace esim::inline evaluate {
namespace {

constexpr float kBent = 0.35F;    // change of the slope of 1/Z, in 1/Z per focal length
constexpr float kJump = 0.01F;    // of 1/Z
constexpr float kSteeper = 3.0F;  // than the slopes on both sides

/// Whether there is a depth discontinuity between b and c, in a row a, b, c, d of 1/Z.
bool is_jump(float a, float b, float c, float d) {
  const float step = std::fabs(c - b);
  return step > kJump * std::max(b, c) && step > kSteeper * std::max(std::fabs(b - a), std::fabs(d - c));
}

}  // namespace

Image<Place> places_of(const Image<float>& depth, double focal_px) {
  const int width = depth.width(), height = depth.height();
  const float bent = kBent / static_cast<float>(focal_px);
  const auto w = [&](int x, int y) {
    const float z = depth(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
    return z > 0 && std::isfinite(z) ? 1 / z : 0.0F;
  };
  Image<Place> places(width, height, Place::surface);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float here = w(x, y);
      const auto bends = [&](float before, float after) { return std::fabs(before - 2 * here + after) > bent * here; };
      const bool across = x > 0 && x + 1 < width && bends(w(x - 1, y), w(x + 1, y));
      const bool down = y > 0 && y + 1 < height && bends(w(x, y - 1), w(x, y + 1));
      if (across || down) places(x, y) = Place::crease;
    }
  }
  const auto mark = [&](int x, int y) {
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height - 1); ++j)
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width - 1); ++i)
        places(i, j) = std::max(places(i, j), Place::near_edge);
    places(x, y) = Place::depth_edge;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (x + 1 < width && is_jump(w(x - 1, y), w(x, y), w(x + 1, y), w(x + 2, y))) mark(x, y), mark(x + 1, y);
      if (y + 1 < height && is_jump(w(x, y - 1), w(x, y), w(x, y + 1), w(x, y + 2))) mark(x, y), mark(x, y + 1);
    }
  }
  return places;
}

}  // namespace esim::inline evaluate
