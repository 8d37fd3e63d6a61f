#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "esim/backends/splats/splat_clusters.h"

// Private to backends/splats.
namespace esim::inline backends::inline splats {

/// A splat in the image. At the pixel (x + dx, y + dy), its opacity is 2^(peak + xx dx² + xy dx dy + yy dy²), and the
/// inverse depth at which it contributes most is nearness + right dx + down dy, between `farthest` and `nearest`.
struct alignas(64) ScreenSplat {
  float x, y;
  float xx, xy, yy;
  float peak;
  float nearness, right, down;  // 1/m, 1/m/px
  float farthest, nearest;      // 1/m
  float colour[3];
  float object;    // 0: static; i + 1: the i-th moving object
  float distance;  // of the centre, m
};

/// The splats of a cluster in the image, and the pixels in which each may be visible: columns from left to right and
/// rows from top to bottom, none if left > right.
struct ProjectedCluster {
  static constexpr std::size_t kMost = SplatClusters::kMost;
  std::array<ScreenSplat, kMost> splats;
  alignas(64) std::array<std::int16_t, kMost> left, right, top, bottom;

  std::size_t count;
  std::int16_t first_column, last_column, first_row, last_row;  // of all splats

  void set_bounds(std::size_t splat_count) {
    count = splat_count;
    first_column = first_row = 32767, last_column = last_row = -32768;
    for (std::size_t i = 0; i < count; ++i) {
      first_column = std::min(first_column, left[i]), last_column = std::max(last_column, right[i]);
      first_row = std::min(first_row, top[i]), last_row = std::max(last_row, bottom[i]);
    }
  }
};

}  // namespace esim::inline backends::inline splats
