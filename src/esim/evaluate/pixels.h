#pragma once

#include <vector>

#include "esim/core/image.h"

namespace esim::inline evaluate {

/// A pixel's column and row.
struct PixelPosition {
  int x = 0, y = 0;
  bool operator==(const PixelPosition&) const = default;
};

/// `count` different pixels, spread evenly over the image by the R2 sequence (Roberts 2018): the k-th lies at the
/// fractional parts of k / g and k / g^2, with g^3 = g + 1; repeated pixels are skipped. If count is 0 or exceeds the
/// number of pixels, all pixels, row by row.
std::vector<PixelPosition> spread_pixels(int width, int height, int count);

/// Finds the pixels of a set that lie in a tile.
class PixelIndex {
 public:
  PixelIndex(int width, int height, const std::vector<PixelPosition>& pixels);

  /// Calls visit(i) for each pixel i that lies in the tile.
  template <typename Visit>
  void for_each_in(const Tile& tile, const Visit& visit) const {
    for (int row = tile.y / kCell; row * kCell < tile.y + tile.height; ++row) {
      for (int column = tile.x / kCell; column * kCell < tile.x + tile.width; ++column) {
        for (const int i : cells_(column, row)) {
          const PixelPosition& p = pixels_[static_cast<std::size_t>(i)];
          const bool inside = p.x >= tile.x && p.x < tile.x + tile.width && p.y >= tile.y && p.y < tile.y + tile.height;
          if (inside) visit(i);
        }
      }
    }
  }

 private:
  static constexpr int kCell = 16;

  std::vector<PixelPosition> pixels_;
  Image<std::vector<int>> cells_;
};

}  // namespace esim::inline evaluate
