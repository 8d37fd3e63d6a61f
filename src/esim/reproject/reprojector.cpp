#include "esim/reproject/reprojector.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "esim/reproject/lens.h"
#include "esim/reproject/spline_coefficients.h"

namespace esim {
namespace {

/// A surface is the one that a keyframe sees where their nearness agrees to this share.
constexpr float kSameSurface = 0.02F;

/// Where the points of a row of the view appear in a keyframe, and what is found there.
struct RowLookup {
  explicit RowLookup(int width)
      : u(static_cast<std::size_t>(width)), v(u.size()), nearness(u.size()), value(u.size()), seen(u.size()) {}
  std::vector<float> u, v, nearness, value, seen;
};

double greatest_radius(const PixelRays& rays) {
  double greatest = 0;
  for (int y = 0; y < rays.x.height(); ++y)
    for (int x = 0; x < rays.x.width(); ++x)
      greatest = std::max(greatest, std::hypot(double{rays.x(x, y)}, double{rays.y(x, y)}));
  return greatest * (1 + 1e-5);
}

/// Takes points from the view to the keyframe: [begin, end) of bearings (x, y, 1) and nearness w.
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

/// Looks the points up by the spline. `seen` is 1 where they lie in the
/// image and, with `depth`, on the surface there.
template <bool depth>
void look_up_row(const Keyframe& keyframe, float offset, RowLookup& row) {
  const int stride = keyframe.root.width(), count = static_cast<int>(row.u.size());
  const float right = static_cast<float>(stride - 1), bottom = static_cast<float>(keyframe.root.height() - 1);
  const float* const c = keyframe.root.data();
  const float* const near = keyframe.front.data();
  const float *const u = row.u.data(), *const v = row.v.data(), *const w = row.nearness.data();
  float *const value = row.value.data(), *const seen = row.seen.data();
#pragma omp simd
  for (int x = 0; x < count; ++x) {
    bool same = true;
    const float column = u[x] - offset, line = v[x] - offset;
    const bool inside = u[x] >= 0 && u[x] <= right && v[x] >= 0 && v[x] <= bottom;
    const float clamped_column = std::min(std::max(column, 1.0F), right - 1.001F);
    const float clamped_line = std::min(std::max(line, 1.0F), bottom - 1.001F);
    const int i = static_cast<int>(clamped_column), j = static_cast<int>(clamped_line);
    const CubicSpline across(clamped_column - static_cast<float>(i)), down(clamped_line - static_cast<float>(j));
    const int r0 = (j - 1) * stride + (i - 1), r1 = r0 + stride, r2 = r1 + stride, r3 = r2 + stride;
    const float root =
        down(across(c[r0], c[r0 + 1], c[r0 + 2], c[r0 + 3]), across(c[r1], c[r1 + 1], c[r1 + 2], c[r1 + 3]),
             across(c[r2], c[r2 + 1], c[r2 + 2], c[r2 + 3]), across(c[r3], c[r3 + 1], c[r3 + 2], c[r3 + 3]));
    value[x] = root * root;
    if constexpr (depth) {
      const int k = static_cast<int>(std::min(std::max(u[x], 0.0F), right - 1e-3F));
      const int l = static_cast<int>(std::min(std::max(v[x], 0.0F), bottom - 1e-3F));
      const int n = l * stride + k;
      const float w0 = near[n], w1 = near[n + 1], w2 = near[n + stride], w3 = near[n + stride + 1];
      const float low = std::min(std::min(w0, w1), std::min(w2, w3)),
                  high = std::max(std::max(w0, w1), std::max(w2, w3));
      same = w[x] >= low * (1 - kSameSurface) && w[x] <= high * (1 + kSameSurface);
    }
    seen[x] = inside && same ? 1.0F : 0.0F;
  }
}

/// The later keyframe's share in between; never quite none, for what the other does not see.
float share_of_later(const Keyframe& before, const Keyframe& after, TimeNs t) {
  const TimeNs interval = after.view.t - before.view.t;
  const double share = interval > 0 ? static_cast<double>(t - before.view.t) / static_cast<double>(interval) : 0.0;
  return static_cast<float>(std::clamp(share, 1e-4, 1 - 1e-4));
}

/// Where no keyframe's pixel fell, the farther one of the surfaces beside.
void fill_gaps(float* nearness, int width) {
  for (int x = 0; x < width;) {
    if (nearness[x] >= 0) {
      ++x;
      continue;
    }
    int end = x;
    while (end < width && nearness[end] < 0) ++end;
    const float right = end < width ? nearness[end] : (x > 0 ? nearness[x - 1] : 0.0F);
    const float left = x > 0 ? nearness[x - 1] : right;
    std::fill(nearness + x, nearness + end, std::min(left, right));
    x = end;
  }
}

}  // namespace

Reprojector::Reprojector(const KeyframeLayout& layout, bool at_infinity, const Workers& workers)
    : layout_(layout),
      at_infinity_(at_infinity),
      rays_(layout.sensor),
      keyframe_rays_(layout.camera),
      greatest_radius_(greatest_radius(keyframe_rays_)),
      workers_(workers),
      splat_(layout_, keyframe_rays_, greatest_radius_, workers) {}

void Reprojector::reconstruct(const Keyframe& before, const Keyframe& after, const RenderRequest& view, bool apart,
                              Reconstruction& result) {
  const int width = layout_.sensor.width, height = layout_.sensor.height;
  const auto fit = [&](Image<float>& image) {
    if (image.width() != width || image.height() != height) image = Image<float>(width, height);
  };
  fit(result.irradiance);
  if (apart) fit(result.from_before), fit(result.from_after);
  if (at_infinity_) {
    if (surface_.nearness.empty()) surface_.nearness = Image<float>(width, height, 0.0F);
  } else {
    splat_.splat({&before, &after}, view, surface_);
  }

  const std::vector<ViewChange> changes0 = view_changes(view, before.view), changes1 = view_changes(view, after.view);
  const float share = share_of_later(before, after, view.t);
  std::vector<std::int64_t> unseen(static_cast<std::size_t>(height));
  std::visit(
      [&](const auto& model) {
        const Projector project(layout_.camera, model, greatest_radius_);
        workers_.for_each(height, [&](int y) {
          RowLookup row0(width), row1(width);
          float* const w = surface_.nearness.row(y);
          const std::uint16_t* const object = view.objects.empty() || at_infinity_ ? nullptr : surface_.object.row(y);
          std::int64_t& nowhere = unseen[static_cast<std::size_t>(y)];
          fill_gaps(w, width);
          for (int begin = 0; begin < width;) {
            int end = object != nullptr ? begin + 1 : width;
            while (end < width && object[end] == object[begin]) ++end;
            const std::size_t which = object != nullptr ? object[begin] : 0;
            project_row(project, changes0[which], rays_.x.row(y), rays_.y.row(y), w, begin, end, row0);
            project_row(project, changes1[which], rays_.x.row(y), rays_.y.row(y), w, begin, end, row1);
            begin = end;
          }
          at_infinity_ ? look_up_row<false>(before, layout_.offset(), row0)
                       : look_up_row<true>(before, layout_.offset(), row0);
          at_infinity_ ? look_up_row<false>(after, layout_.offset(), row1)
                       : look_up_row<true>(after, layout_.offset(), row1);
          float* const out = result.irradiance.row(y);
          for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(x);
            const bool neither = row0.seen[i] + row1.seen[i] == 0;
            nowhere += neither;
            const float w0 = (1 - share) * (neither ? 1.0F : row0.seen[i]);
            const float w1 = share * (neither ? 1.0F : row1.seen[i]);
            out[x] = (w0 * row0.value[i] + w1 * row1.value[i]) / (w0 + w1);
          }
          if (!apart) return;
          for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(x);
            result.from_before(x, y) = row0.seen[i] > 0 ? row0.value[i] : -1.0F;
            result.from_after(x, y) = row1.seen[i] > 0 ? row1.value[i] : -1.0F;
          }
        });
      },
      layout_.camera.distortion);
  result.unseen = std::accumulate(unseen.begin(), unseen.end(), std::int64_t{0});
}

}  // namespace esim
