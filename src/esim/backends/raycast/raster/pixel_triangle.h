#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/backends/raycast/raster/cell_surfaces.h"
#include "esim/backends/raycast/raster/convex.h"

// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline backends::inline raycast {

/// A triangle that may be visible in a pixel, in the pixel's coordinates.
struct PixelTriangle {
  // Its weights and its inverse depth as functions of the position, and half of the ranges of their values.
  alignas(16) std::array<float, 4> middle, s, t, reach;
  float nearest, farthest;     ///< bounds of the inverse depth in the pixel
  bool outside;                ///< of the pixel
  bool in_middle;              ///< covers the pixel's middle
  unsigned crossing;           ///< a bit for each weight that is not positive in the whole pixel
  std::uint32_t triangle;      ///< of the cell's
  std::uint32_t group, index;  ///< as in ScreenTriangle

  OfPixel function(std::size_t k) const { return {middle[k], s[k], t[k]}; }
  OfPixel inverse_depth() const { return function(3); }
};

/// The triangles of a pixel.
class PixelTriangles {
 public:
  /// Takes the candidates of a pixel of a cell, in their order.
  void take(const CellSurfaces& surfaces, const ImageCell& cell, std::size_t pixel, std::span<const Candidate> found) {
    if (all_.size() < found.size()) all_.resize(2 * found.size());
    count_ = found.size();
    const hn::FixedTag<float, 4> d;
    const auto bearing_x = hn::Set(d, cell.x[pixel]), bearing_y = hn::Set(d, cell.y[pixel]);
    const auto dx_du = hn::Set(d, cell.dx_du[pixel]), dy_du = hn::Set(d, cell.dy_du[pixel]);
    const auto dx_dv = hn::Set(d, cell.dx_dv[pixel]), dy_dv = hn::Set(d, cell.dy_dv[pixel]);
    for (std::size_t i = 0; i < count_; ++i) {
      PixelTriangle& to = all_[i];
      const ScreenTriangle& seen = surfaces.triangle(found[i].triangle);
      const auto x = hn::Load(d, seen.x.data()), y = hn::Load(d, seen.y.data()), one = hn::Load(d, seen.one.data());
      const auto middle = hn::Add(hn::MulAdd(x, bearing_x, hn::Mul(y, bearing_y)), one);
      const auto s = hn::MulAdd(x, dx_du, hn::Mul(y, dy_du)), t = hn::MulAdd(x, dx_dv, hn::Mul(y, dy_dv));
      const auto reach = hn::Mul(hn::Set(d, 0.5F), hn::Add(hn::Abs(s), hn::Abs(t)));
      hn::Store(middle, d, to.middle.data()), hn::Store(s, d, to.s.data());
      hn::Store(t, d, to.t.data()), hn::Store(reach, d, to.reach.data());
      to.nearest = std::min(to.middle[3] + to.reach[3], seen.nearest);
      to.farthest = std::max(to.middle[3] - to.reach[3], seen.farthest);
      to.crossing = edges_of(hn::Lt(middle, reach)), to.outside = edges_of(hn::Lt(middle, hn::Neg(reach))) != 0;
      to.in_middle = edges_of(hn::Ge(middle, hn::Zero(d))) == 7;
      to.triangle = found[i].triangle, to.group = seen.group, to.index = seen.index;
    }
  }

  std::span<const PixelTriangle> all() const { return std::span(all_).first(count_); }
  const PixelTriangle& operator[](std::size_t i) const { return all_[i]; }

 private:
  std::vector<PixelTriangle> all_;
  std::size_t count_ = 0;
};

}  // namespace esim::inline backends::inline raycast
