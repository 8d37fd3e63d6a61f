#pragma once

#include <algorithm>
#include <array>

#include "esim/core/image.h"
#include "esim/geometry/camera.h"

namespace esim {

/// A value per pixel. Where all rows are the same, as without distortion, one is kept: rendering waits for memory.
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

/// A camera's geometry, tabulated once per pixel, lens distortion included.
struct PixelRays {
  explicit PixelRays(const Camera& camera);

  // Bearing of the pixel's centre in the camera frame: (x, y, 1).
  PixelTable x, y;

  // d(pixel) / d(bearing), px: how the image of a point moves when its bearing does.
  PixelTable du_dx, du_dy, dv_dx, dv_dy;

  // d(bearing) / d(pixel): the pixel's footprint, the inverse of the above.
  PixelTable dx_du, dx_dv, dy_du, dy_dv;
};

/// The rays of K pixels, one array per quantity, for loops that compile to SIMD code.
template <int K>
struct RayLanes {
  alignas(64) std::array<float, K> x, y;
  alignas(64) std::array<float, K> dx_du, dx_dv, dy_du, dy_dv;

  /// Takes Count pixels of a row, from column `first` on, into lanes [lane, lane + Count).
  template <int Count>
  void load(const PixelRays& rays, int first, int row, int lane) {
    for_each_table(rays, [&](const PixelTable& table, std::array<float, K>& lanes) {
      std::copy_n(table.row(row) + first, Count, lanes.data() + lane);
    });
  }

  /// The same for any number of them; lanes up to lane + room repeat the last one.
  void load(const PixelRays& rays, int first, int row, int lane, int count, int room) {
    for_each_table(rays, [&](const PixelTable& table, std::array<float, K>& lanes) {
      for (int i = 0; i < room; ++i)
        lanes[static_cast<unsigned>(lane + i)] = table(first + std::min(i, count - 1), row);
    });
  }

  /// Fills all lanes with a span of a row.
  void load_span(const PixelRays& rays, int first, int row, int count) {
    if (count == K) {
      load<K>(rays, first, row, 0);
    } else {
      load(rays, first, row, 0, count, K);
    }
  }

 private:
  template <typename Body>
  void for_each_table(const PixelRays& rays, const Body& body) {
    body(rays.x, x), body(rays.y, y);
    body(rays.dx_du, dx_du), body(rays.dx_dv, dx_dv), body(rays.dy_du, dy_du), body(rays.dy_dv, dy_dv);
  }
};

}  // namespace esim
