#pragma once

#include <algorithm>
#include <vector>

#include "esim/reproject/depth_splat.h"
#include "esim/reproject/lens.h"
#include "esim/reproject/spline_coefficients.h"

namespace esim::inline reproject {

/// A keyframe sees a surface if their nearness agrees within this fraction.
inline constexpr float kSameSurface = 0.02F;

/// Positions of the points of a row of the view in a keyframe, and the values there.
struct RowLookup {
  explicit RowLookup(std::size_t points)
      : u(points), v(u.size()), nearness(u.size()), value(u.size()), seen(u.size()) {}
  std::vector<float> u, v, nearness, value, seen;
};

/// Projects the points [begin, end), with bearings (x, y, 1) and nearness w, from the view to the keyframe.
template <typename Model>
void project_row(const Projector<Model>& project, const ViewChange& c, const float* bx, const float* by, const float* w,
                 int begin, int end, RowLookup& row) {
  const float r00 = c.R(0, 0), r01 = c.R(0, 1), r02 = c.R(0, 2), r10 = c.R(1, 0), r11 = c.R(1, 1), r12 = c.R(1, 2),
              r20 = c.R(2, 0), r21 = c.R(2, 1), r22 = c.R(2, 2);
  const float t0 = c.t.x(), t1 = c.t.y(), t2 = c.t.z();
  float *const u = row.u.data(), *const v = row.v.data(), *const nearness = row.nearness.data();
#pragma omp simd
  for (int x = begin; x < end; ++x) {
    const float y0 = r00 * bx[x] + r01 * by[x] + r02 + w[x] * t0;
    const float y1 = r10 * bx[x] + r11 * by[x] + r12 + w[x] * t1;
    const float y2 = r20 * bx[x] + r21 * by[x] + r22 + w[x] * t2;
    project(y0, y1, y2, u[x], v[x]);
    nearness[x] = w[x] / y2;
  }
}

/// Points are in the image as far as this beyond the centres of its outer pixels, px: rounding errors move them.
inline constexpr float kOutside = 0.01F;

/// Looks up the points with the spline. `seen` is 1 if a point lies in the image and, with `depth`, on the surface
/// there.
template <bool depth>
void look_up_row(const Keyframe::Light& light, RowLookup& row) {
  const float offset = light.offset;
  const int stride = light.root.width(), count = static_cast<int>(row.u.size());  // with its border
  const float right = static_cast<float>(stride - 3), bottom = static_cast<float>(light.root.height() - 3);
  const float* const c = light.root.data();
  const float* const near = light.front.data();
  const float *const u = row.u.data(), *const v = row.v.data(), *const w = row.nearness.data();
  float *const value = row.value.data(), *const seen = row.seen.data();
#pragma omp simd
  for (int x = 0; x < count; ++x) {
    bool same = true;
    const float column = u[x] - offset, line = v[x] - offset;
    const bool inside = u[x] >= -kOutside && u[x] <= right + kOutside && v[x] >= -kOutside && v[x] <= bottom + kOutside;
    const float clamped_column = std::min(std::max(column, 0.0F), right - 1e-3F);
    const float clamped_line = std::min(std::max(line, 0.0F), bottom - 1e-3F);
    const int i = static_cast<int>(clamped_column), j = static_cast<int>(clamped_line);
    const CubicSpline across(clamped_column - static_cast<float>(i)), down(clamped_line - static_cast<float>(j));
    const int r0 = j * stride + i, r1 = r0 + stride, r2 = r1 + stride, r3 = r2 + stride;
    const float root =
        down(across(c[r0], c[r0 + 1], c[r0 + 2], c[r0 + 3]), across(c[r1], c[r1 + 1], c[r1 + 2], c[r1 + 3]),
             across(c[r2], c[r2 + 1], c[r2 + 2], c[r2 + 3]), across(c[r3], c[r3 + 1], c[r3 + 2], c[r3 + 3]));
    value[x] = root * root;
    if constexpr (depth) {
      const int k = static_cast<int>(std::min(std::max(u[x], 0.0F), right - 1e-3F));
      const int l = static_cast<int>(std::min(std::max(v[x], 0.0F), bottom - 1e-3F));
      const int n = l * (stride - 2) + k, below = n + stride - 2;
      const float w0 = near[n], w1 = near[n + 1], w2 = near[below], w3 = near[below + 1];
      const float low = std::min(std::min(w0, w1), std::min(w2, w3)),
                  high = std::max(std::max(w0, w1), std::max(w2, w3));
      same = w[x] >= low * (1 - kSameSurface) && w[x] <= high * (1 + kSameSurface);
    }
    seen[x] = inside && same ? 1.0F : 0.0F;
  }
}

}  // namespace esim::inline reproject
