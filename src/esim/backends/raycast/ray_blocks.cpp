#include "esim/backends/raycast/ray_blocks.h"

#include <algorithm>
#include <cmath>

namespace esim::inline backends::inline raycast {

namespace {

BearingBounds bounds_of(const RayBlock& block) {
  BearingBounds bounds{block.x[0], block.x[0], block.y[0], block.y[0]};
  for (int i = 0; i < RayBlock::kPixels; ++i) {
    const float half_width = 0.5F * (std::fabs(block.dx_du[i]) + std::fabs(block.dx_dv[i]));
    const float half_height = 0.5F * (std::fabs(block.dy_du[i]) + std::fabs(block.dy_dv[i]));
    bounds.left = std::min(bounds.left, block.x[i] - half_width);
    bounds.right = std::max(bounds.right, block.x[i] + half_width);
    bounds.top = std::min(bounds.top, block.y[i] - half_height);
    bounds.bottom = std::max(bounds.bottom, block.y[i] + half_height);
  }
  return bounds;
}

}  // namespace

RayBlocks::RayBlocks(const PixelRays& rays) {
  constexpr int kSide = RayBlock::kSide;
  const int width = rays.x.width(), height = rays.x.height();
  columns_ = (width + kSide - 1) / kSide;
  for (int y = 0; y < height; y += kSide) {
    for (int x = 0; x < width; x += kSide) {
      RayBlock& block = blocks_.emplace_back();
      for (int i = 0; i < RayBlock::kPixels; ++i) {
        const int column = std::min(x + i % kSide, width - 1), row = std::min(y + i / kSide, height - 1);
        block.x[i] = rays.x(column, row), block.y[i] = rays.y(column, row);
        block.dx_du[i] = rays.dx_du(column, row), block.dx_dv[i] = rays.dx_dv(column, row);
        block.dy_du[i] = rays.dy_du(column, row), block.dy_dv[i] = rays.dy_dv(column, row);
      }
    }
  }

  cell_columns_ = (width + kCellWidth - 1) / kCellWidth;
  for (int y = 0; y < height; y += kCellHeight) {
    for (int x = 0; x < width; x += kCellWidth) {
      BearingBounds& cell = cells_.emplace_back(bounds_of(at(x, y)));
      for (int row = y; row < std::min(y + kCellHeight, height); row += kSide) {
        for (int column = x; column < std::min(x + kCellWidth, width); column += kSide)
          cell = cell.with(bounds_of(at(column, row)));
      }
    }
  }
}

}  // namespace esim::inline backends::inline raycast
