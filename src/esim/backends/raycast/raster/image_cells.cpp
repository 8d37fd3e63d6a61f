#include "esim/backends/raycast/raster/image_cells.h"

#include <cmath>

namespace esim::inline backends::inline raycast {
namespace {

/// The axis along which the bearings `at` of n columns (rows) grow or fall, in steps of `stride`; there are `m` of
/// each. `half`: half of the extent of the largest pixel.
ImageCell::Axis axis_of(const std::array<float, ImageCell::kPixels>& at, int n, int stride, int m, int other_stride,
                        float half) {
  constexpr float kMargin = 0.02F;  // px
  const auto value = [&](int i, int j) { return at[static_cast<std::size_t>(i * stride + j * other_stride)]; };
  double begin = 0, end = 0;
  for (int j = 0; j < m; ++j) begin += double{value(0, j)} / m, end += double{value(n - 1, j)} / m;
  ImageCell::Axis axis{0, 0, static_cast<float>(n) + 1, n};
  if (n == 1 || begin == end) return axis;  // all of them
  axis.scale = static_cast<float>((n - 1) / (end - begin));
  axis.offset = static_cast<float>(-(n - 1) * begin / (end - begin));
  float deviation = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const float error = std::fabs(axis.scale * value(i, j) + axis.offset - static_cast<float>(i));
      deviation = std::max(deviation, error);
    }
  }
  axis.reach = deviation + std::fabs(axis.scale) * half + kMargin;
  return axis;
}

}  // namespace

ImageCells::ImageCells(const PixelRays& rays, float side) {
  constexpr int kWidth = ImageCell::kWidth, kHeight = ImageCell::kHeight;
  const int width = rays.x.width(), height = rays.x.height();
  columns_ = (width + kWidth - 1) / kWidth;
  cells_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>((height + kHeight - 1) / kHeight));
  for (int top = 0; top < height; top += kHeight) {
    for (int left = 0; left < width; left += kWidth) {
      ImageCell& cell = cells_.emplace_back();
      cell.bounds = {kInfinity, -kInfinity, kInfinity, -kInfinity};
      cell.half_width = cell.half_height = cell.extent = 0;
      for (int i = 0; i < ImageCell::kPixels; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const int u = std::min(left + i % kWidth, width - 1), v = std::min(top + i / kWidth, height - 1);
        cell.x[k] = rays.x(u, v), cell.y[k] = rays.y(u, v);
        cell.dx_du[k] = side * rays.dx_du(u, v), cell.dx_dv[k] = side * rays.dx_dv(u, v);
        cell.dy_du[k] = side * rays.dy_du(u, v), cell.dy_dv[k] = side * rays.dy_dv(u, v);
        const float half_width = 0.5F * (std::fabs(cell.dx_du[k]) + std::fabs(cell.dx_dv[k]));
        const float half_height = 0.5F * (std::fabs(cell.dy_du[k]) + std::fabs(cell.dy_dv[k]));
        cell.bounds = cell.bounds.with(
            {cell.x[k] - half_width, cell.x[k] + half_width, cell.y[k] - half_height, cell.y[k] + half_height});
        cell.half_width = std::max(cell.half_width, half_width);
        cell.half_height = std::max(cell.half_height, half_height);
        cell.extent = std::max(cell.extent, std::fabs(cell.x[k]) + std::fabs(cell.y[k]) + 1);
      }
      const int columns = std::min(kWidth, width - left), rows = std::min(kHeight, height - top);
      cell.column = axis_of(cell.x, columns, 1, rows, kWidth, cell.half_width);
      cell.row = axis_of(cell.y, rows, kWidth, columns, 1, cell.half_height);
    }
  }
}

}  // namespace esim::inline backends::inline raycast
