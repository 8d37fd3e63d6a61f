#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "esim/backends/raycast/raster/convex.h"
#include "esim/backends/raycast/raster/image_cells.h"
#include "esim/backends/raycast/raster/screen_triangles.h"

// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline backends::inline raycast {

/// From bearings to positions in a pixel.
struct PixelFrame {
  float x, y;                ///< its centre
  float s_x, s_y, t_x, t_y;  ///< derivatives of the position by the bearing

  PixelFrame(const ImageCell& cell, std::size_t pixel) : x(cell.x[pixel]), y(cell.y[pixel]) {
    const float dx_du = cell.dx_du[pixel], dx_dv = cell.dx_dv[pixel], dy_du = cell.dy_du[pixel];
    const float dy_dv = cell.dy_dv[pixel], per_det = 1 / (dx_du * dy_dv - dx_dv * dy_du);
    s_x = dy_dv * per_det, s_y = -dx_dv * per_det, t_x = -dy_du * per_det, t_y = dx_du * per_det;
  }

  PixelPoint at(float bearing_x, float bearing_y) const {
    const float dx = bearing_x - x, dy = bearing_y - y;
    return {s_x * dx + s_y * dy, t_x * dx + t_y * dy};
  }
};

/// Triangles in the coordinates of a pixel (see PixelPoint), and the integrals over their parts in the pixel. Their
/// corners must be less than about 1000 px away, since positions are rounded to 1e-7 of that.
struct ClippedTriangles {
  static constexpr std::size_t kCount = 8;
  using D = hn::CappedTag<float, kCount>;
  using Lanes = std::array<float, kCount>;

  alignas(64) std::array<Lanes, 3> s, t;  ///< corners, in either order
  alignas(64) Lanes area, of_s, of_t, of_ss, of_st, of_tt;

  /// False if a corner is too far away, or too near to the camera.
  bool set(std::size_t lane, const ScreenTriangle& triangle, const PixelFrame& frame) {
    constexpr float kFar = 500;  // px
    bool is_near = triangle.is_in_front();
    for (std::size_t c = 0; c < 3; ++c) {
      const PixelPoint corner = frame.at(triangle.corner_x[c], triangle.corner_y[c]);
      s[c][lane] = corner.s, t[c][lane] = corner.t;
      is_near = is_near && std::fabs(corner.s) < kFar && std::fabs(corner.t) < kFar;
    }
    return is_near;
  }

  Moments moments(std::size_t lane) const {
    return {area[lane], of_s[lane], of_t[lane], of_ss[lane], of_st[lane], of_tt[lane]};
  }

  /// With Green's theorem: the integral of s^m t^n over the part in the pixel is the sum over the sides of the
  /// integrals of c(s)^(m+1) t^n / (m+1) dt for |t| < 0.5, where c limits s to [-0.5, 0.5].
  void integrate() {
    const D d;
    for (std::size_t i = 0; i < kCount; i += hn::Lanes(d)) integrate(d, i);
  }

 private:
  void integrate(D d, std::size_t i) {
    using V = hn::Vec<D>;
    const V low = hn::Set(d, -0.5F), high = hn::Set(d, 0.5F), zero = hn::Zero(d), one = hn::Set(d, 1.0F);
    const auto inside = [&](V x) { return hn::Min(hn::Max(x, low), high); };
    V sum = zero, sum_s = zero, sum_t = zero, sum_ss = zero, sum_st = zero, sum_tt = zero;
    for (std::size_t from = 0; from < 3; ++from) {
      const std::size_t to = from < 2 ? from + 1 : 0;
      const V s0 = hn::Load(d, &s[from][i]), t0 = hn::Load(d, &t[from][i]);
      const V s1 = hn::Load(d, &s[to][i]), t1 = hn::Load(d, &t[to][i]);
      const V dt = hn::Sub(t1, t0);
      const auto flat = hn::Eq(dt, zero);
      const V slope = hn::Div(hn::Sub(s1, s0), hn::IfThenElse(flat, one, dt));
      // From (sa, ta) to (sb, tb): the part of the side that may be in the pixel.
      const V ta = inside(t0), tb = inside(t1), h = hn::Sub(tb, ta);
      const V sa = hn::MulAdd(hn::Sub(ta, t0), slope, s0), sb = hn::MulAdd(hn::Sub(tb, t0), slope, s0);
      const V ds = hn::Sub(sb, sa);
      const V per_ds = hn::Div(one, hn::IfThenElse(hn::Eq(ds, zero), one, ds));
      const auto along = [&](V to_s) { return hn::Min(hn::Max(hn::Mul(hn::Sub(to_s, sa), per_ds), zero), one); };
      const V at_low = along(low), at_high = along(high);
      const V enter = hn::Min(at_low, at_high), leave = hn::Max(at_low, at_high);
      // c is linear in each part, so that two nodes are exact (Gauss and Legendre).
      const auto add_part = [&](V begin, V end) {
        const V half = hn::Mul(high, hn::Sub(end, begin)), middle = hn::Mul(high, hn::Add(begin, end));
        const V weight = hn::Mul(half, h), offset = hn::Mul(half, hn::Set(d, 0.577350269F));
        for (const V& u : {hn::Sub(middle, offset), hn::Add(middle, offset)}) {
          const V c = inside(hn::MulAdd(u, ds, sa)), at = hn::MulAdd(u, h, ta);
          const V w = hn::Mul(weight, c), ws = hn::Mul(w, c), wt = hn::Mul(w, at);
          sum = hn::Add(sum, w), sum_s = hn::Add(sum_s, ws), sum_t = hn::Add(sum_t, wt);
          sum_ss = hn::MulAdd(ws, c, sum_ss), sum_st = hn::MulAdd(ws, at, sum_st), sum_tt = hn::MulAdd(wt, at, sum_tt);
        }
      };
      add_part(zero, enter), add_part(enter, leave), add_part(leave, one);
    }
    const V sign = hn::CopySign(one, sum), half = hn::Mul(sign, high);
    hn::Store(hn::Mul(sign, sum), d, &area[i]);
    hn::Store(hn::Mul(half, sum_s), d, &of_s[i]), hn::Store(hn::Mul(sign, sum_t), d, &of_t[i]);
    hn::Store(hn::Mul(sign, hn::Mul(sum_ss, hn::Set(d, 1.0F / 3))), d, &of_ss[i]);
    hn::Store(hn::Mul(half, sum_st), d, &of_st[i]), hn::Store(hn::Mul(sign, sum_tt), d, &of_tt[i]);
  }
};

}  // namespace esim::inline backends::inline raycast
