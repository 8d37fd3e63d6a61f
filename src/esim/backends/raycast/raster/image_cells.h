#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "esim/backends/raycast/ray_blocks.h"
#include "esim/core/image.h"

// Private to backends/raycast.
namespace esim::inline backends::inline raycast {

/// Columns or rows of a cell, from `first` to `last`; none if first > last.
struct Range {
  int first, last;
};

/// A cell of the image, of 32 x 8 pixels. Pixels outside the image repeat its last column or row.
struct alignas(64) ImageCell {
  static constexpr int kWidth = 32, kHeight = 8, kPixels = kWidth * kHeight;

  // Bearing of the pixel's centre (x, y, 1) in the camera frame, row-major.
  std::array<float, kPixels> x, y;
  // The pixel's area: the bearing moves by (dx_du, dy_du) from its left side to its right one, by (dx_dv, dy_dv) from
  // its upper side to its lower one.
  std::array<float, kPixels> dx_du, dx_dv, dy_du, dy_dv;

  BearingBounds bounds;           // of all areas
  float half_width, half_height;  // of the largest area, along x and y
  float extent;                   // largest |x| + |y| + 1 of a bearing

  /// The columns (rows) whose areas may contain bearings with x (y) in an interval.
  struct Axis {
    float scale, offset, reach;
    int count;

    Range range(float from, float to) const {
      const float last = static_cast<float>(count - 1);
      const float a = scale * from + offset, b = scale * to + offset;
      // Also for NaN and infinity.
      const float low = std::min(a, b) - reach, high = std::max(a, b) + reach;
      return {low > 0 ? static_cast<int>(std::min(low + 1, last + 1)) : 0,
              high < last ? static_cast<int>(std::max(high, -1.0F)) : count - 1};
    }
  };
  Axis column, row;
};

/// A camera's image in cells aligned with its corner, so that they do not depend on the requested tile.
class ImageCells {
 public:
  /// `side` of the square that edges are averaged over, in the footprints of `rays`.
  ImageCells(const PixelRays& rays, float side);

  /// The cell that begins at column x and row y, multiples of its width and height.
  const ImageCell& at(int x, int y) const {
    return cells_[static_cast<std::size_t>(y / ImageCell::kHeight * columns_ + x / ImageCell::kWidth)];
  }

 private:
  int columns_;
  std::vector<ImageCell> cells_;
};

}  // namespace esim::inline backends::inline raycast
