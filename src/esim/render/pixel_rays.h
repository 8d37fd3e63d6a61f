#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"

namespace esim::inline render {

/// A value per pixel. If all rows are equal, as without distortion, only one is stored, since rendering is limited by
/// memory bandwidth.
class PixelTable {
 public:
  PixelTable() = default;
  explicit PixelTable(Image<float> values);

  int width() const { return width_; }
  int height() const { return height_; }
  const float* row(int y) const { return values_.row(one_row_ ? 0 : y); }
  float operator()(int x, int y) const { return row(y)[x]; }

 private:
  int width_ = 0, height_ = 0;
  bool one_row_ = false;
  Image<float> values_;
};

/// A camera's geometry, including lens distortion, as tables with a value per pixel.
struct PixelRays {
  /// `footprint`: side of the square that a pixel averages over, px.
  explicit PixelRays(const Camera& camera, double footprint = 1);

  // Bearing of the pixel's centre in the camera frame: (x, y, 1).
  PixelTable x, y;

  // d(pixel) / d(bearing), px.
  PixelTable du_dx, du_dy, dv_dx, dv_dy;

  // d(bearing) / d(pixel) times the footprint: the area that the pixel averages over.
  PixelTable dx_du, dx_dv, dy_du, dy_dv;
};

/// The rays of K neighbouring pixels of a row, one array per quantity, for loops that compile to SIMD code. If a row
/// has fewer, the last one is repeated.
template <int K>
class RayLanes {
 public:
  RayLanes(const PixelRays& rays, int first, int row, int count)
      : x(take(rays.x, first, row, count, 0)),
        y(take(rays.y, first, row, count, 1)),
        dx_du(take(rays.dx_du, first, row, count, 2)),
        dx_dv(take(rays.dx_dv, first, row, count, 3)),
        dy_du(take(rays.dy_du, first, row, count, 4)),
        dy_dv(take(rays.dy_dv, first, row, count, 5)) {}
  RayLanes(const RayLanes&) = delete;
  RayLanes& operator=(const RayLanes&) = delete;

 private:
  std::array<std::array<float, K>, 6> copies_;

 public:
  const float *const x, *const y;
  const float *const dx_du, *const dx_dv, *const dy_du, *const dy_dv;

 private:
  const float* take(const PixelTable& table, int first, int row, int count, std::size_t copy) {
    if (count == K) return table.row(row) + first;
    for (int i = 0; i < K; ++i) copies_[copy][static_cast<std::size_t>(i)] = table(first + std::min(i, count - 1), row);
    return copies_[copy].data();
  }
};

}  // namespace esim::inline render
