#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "esim/render/pixel_rays.h"

namespace esim::inline backends::inline raycast {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A block of 4 x 4 pixels, row-major. Pixels outside the image repeat its last row or column.
struct RayBlock {
  static constexpr int kSide = 4, kPixels = kSide * kSide;

  // Bearing of the pixel's centre (x, y, 1) in the camera frame, and its derivatives by the pixel (u, v).
  alignas(64) float x[kPixels], y[kPixels];
  alignas(64) float dx_du[kPixels], dx_dv[kPixels], dy_du[kPixels], dy_dv[kPixels];

  /// Prefetches it, since there are more blocks than fit into the caches.
  void prefetch() const {
    for (const float* values : {x, y, dx_du, dx_dv, dy_du, dy_dv}) __builtin_prefetch(values);
  }
};

/// A rectangle of bearings: x to the right, y downwards.
struct BearingBounds {
  float left, right, top, bottom;

  /// The smallest rectangle that contains this one and another.
  BearingBounds with(const BearingBounds& other) const {
    return {std::min(left, other.left), std::max(right, other.right), std::min(top, other.top),
            std::max(bottom, other.bottom)};
  }

  bool overlap(const BearingBounds& other) const {
    return left <= other.right && other.left <= right && top <= other.bottom && other.top <= bottom;
  }
};

/// A camera's rays in blocks aligned with the image's corner: rays that are traced together are adjacent in memory, and
/// the blocks do not depend on the requested tile.
class RayBlocks {
 public:
  /// Size in pixels of a cell of the image; blocks in the same cell see nearly the same triangles.
  static constexpr int kCellWidth = 16, kCellHeight = 8;

  explicit RayBlocks(const PixelRays& rays);

  /// The block that begins at column x and row y, multiples of kSide.
  const RayBlock& at(int x, int y) const { return blocks_[index(x, y)]; }

  /// Bounds of all rays of the cell that begins there, for all positions within the pixels.
  const BearingBounds& cell(int x, int y) const {
    return cells_[static_cast<std::size_t>(y / kCellHeight * cell_columns_ + x / kCellWidth)];
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y / RayBlock::kSide * columns_ + x / RayBlock::kSide);
  }

  int columns_, cell_columns_;
  std::vector<RayBlock> blocks_;
  std::vector<BearingBounds> cells_;
};

}  // namespace esim::inline backends::inline raycast
