#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "esim/reproject/depth_splat.h"
#include "esim/reproject/lens.h"
#include "esim/reproject/lookup_lanes.h"

// Private to reproject: includes lookup_lanes.h.
namespace esim::inline reproject {

/// A keyframe sees a surface if their nearness agrees within this fraction.
inline constexpr float kSameSurface = 0.02F;

/// Positions of the points of a row of the view in a keyframe, and the values there. The arrays are filled up with
/// points in the corner of the keyframe to whole vectors.
struct RowLookup {
  explicit RowLookup(std::size_t points)
      : count(points),
        u((points + kLookupLanes - 1) / kLookupLanes * kLookupLanes),
        v(u.size()),
        nearness(u.size()),
        value(u.size()),
        seen(u.size()) {}
  std::size_t count;
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
  const int stride = light.root.width();  // with its border
  const float right = static_cast<float>(stride - 3), bottom = static_cast<float>(light.root.height() - 3);
  const auto all = [](float value) { return hn::Set(kLookupTag, value); };
  const auto first_pixel = [&](LookupLanes at, float last) {
    return hn::Min(hn::Max(at, hn::Zero(kLookupTag)), all(last - 1e-3F));
  };
  const auto between = [&](LookupLanes x, float low, float high) {
    return hn::And(hn::Ge(x, all(low)), hn::Le(x, all(high)));
  };
  for (std::size_t x = 0; x < row.u.size(); x += kLookupLanes) {
    const LookupLanes u = hn::LoadU(kLookupTag, &row.u[x]), v = hn::LoadU(kLookupTag, &row.v[x]);
    auto seen = hn::And(between(u, -kOutside, right + kOutside), between(v, -kOutside, bottom + kOutside));

    const LookupLanes column = first_pixel(hn::Sub(u, all(light.offset)), right),
                      line = first_pixel(hn::Sub(v, all(light.offset)), bottom);
    const LanesOfPlaces places(column, line, stride);
    const LaneSpline across(places.beyond_column), down(places.beyond_line);
    std::array<LookupLanes, 4> roots;
    for (int k = 0; k < 4; ++k)
      roots[static_cast<std::size_t>(k)] = across(fours_at(light.root.data() + k * stride, places.first));
    const LookupLanes root = down(roots);
    hn::StoreU(hn::Mul(root, root), kLookupTag, &row.value[x]);

    if constexpr (depth) {
      const LanesOfPlaces pixels(first_pixel(u, right), first_pixel(v, bottom), stride - 2);
      const auto [w0, w1, w2, w3] = squares_at(light.front.data(), pixels.first, stride - 2);
      const LookupLanes low = hn::Min(hn::Min(w0, w1), hn::Min(w2, w3)),
                        high = hn::Max(hn::Max(w0, w1), hn::Max(w2, w3));
      const LookupLanes w = hn::LoadU(kLookupTag, &row.nearness[x]);
      seen = hn::And(seen, hn::And(hn::Ge(w, hn::Mul(low, all(1 - kSameSurface))),
                                   hn::Le(w, hn::Mul(high, all(1 + kSameSurface)))));
    }
    hn::StoreU(hn::IfThenElseZero(seen, all(1)), kLookupTag, &row.seen[x]);
  }
}

}  // namespace esim::inline reproject
