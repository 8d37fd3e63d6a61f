#include "esim/reproject/depth_splat.h"

#include <algorithm>
#include <cmath>

#include "esim/reproject/lens.h"

namespace esim {

std::vector<ViewChange> view_changes(const RenderRequest& from, const RenderRequest& to) {
  const SE3 T_to_world = to.camera.T_world_body.inverse();
  std::vector<ViewChange> changes;
  const auto add = [&](const SE3& T_to_from) {
    changes.push_back({T_to_from.rotation.toRotationMatrix().cast<float>(), T_to_from.translation.cast<float>()});
  };
  add(T_to_world * from.camera.T_world_body);
  for (std::size_t i = 0; i < from.objects.size(); ++i) {
    const SE3 T_then_now = to.objects[i].T_world_body * from.objects[i].T_world_body.inverse();
    add(T_to_world * T_then_now * from.camera.T_world_body);
  }
  return changes;
}

DepthSplat::DepthSplat(const KeyframeLayout& layout, const PixelRays& rays, double greatest_radius,
                       const Workers& workers)
    : layout_(layout),
      greatest_radius_(greatest_radius),
      workers_(workers),
      chunks_((layout.columns() + kChunk - 1) / kChunk),
      x_(layout.columns(), layout.rows()),
      y_(x_),
      column_(x_),
      row_(x_),
      inverse_z_(x_),
      first_row_(chunks_, layout.rows()),
      last_row_(chunks_, layout.rows()) {
  for (int row = 0; row < layout.rows(); ++row) {
    for (int column = 0; column < layout.columns(); ++column) {
      const int x = layout.first() + layout.supersampling * column, y = layout.first() + layout.supersampling * row;
      x_(column, row) = rays.x(x, y), y_(column, row) = rays.y(x, y);
    }
  }
}

void DepthSplat::throw_row(const Keyframe& keyframe, const std::vector<ViewChange>& changes, int row) {
  const int width = x_.width();
  const std::uint16_t* const object = keyframe.object.empty() ? nullptr : keyframe.object.row(row);
  const float *const bx = x_.row(row), *const by = y_.row(row), *const w = keyframe.nearness.row(row);
  float *const column_at = column_.row(row), *const row_at = row_.row(row), *const inverse_z = inverse_z_.row(row);

  std::visit(
      [&](const auto& model) {
        const Projector project(layout_.sensor, model, greatest_radius_);
        for (int begin = 0; begin < width;) {
          // Pixels in a row that belong to the same object.
          int end = object == nullptr ? width : begin + 1;
          while (end < width && object[end] == object[begin]) ++end;
          const ViewChange c = changes[object == nullptr ? 0 : object[begin]];
          const float r00 = c.R(0, 0), r01 = c.R(0, 1), r02 = c.R(0, 2), r10 = c.R(1, 0), r11 = c.R(1, 1),
                      r12 = c.R(1, 2), r20 = c.R(2, 0), r21 = c.R(2, 1), r22 = c.R(2, 2);
          const float t0 = c.t.x(), t1 = c.t.y(), t2 = c.t.z();
#pragma omp simd
          for (int x = begin; x < end; ++x) {
            const float y0 = r00 * bx[x] + r01 * by[x] + r02 + w[x] * t0;
            const float y1 = r10 * bx[x] + r11 * by[x] + r12 + w[x] * t1;
            const float y2 = r20 * bx[x] + r21 * by[x] + r22 + w[x] * t2;
            float u, v;
            project(y0, y1, y2, u, v);
            column_at[x] = u;
            row_at[x] = v;
            inverse_z[x] = 1.0F / y2;
          }
          begin = end;
        }
      },
      layout_.camera.distortion);

  for (int chunk = 0; chunk < chunks_; ++chunk) {
    const auto [first, last] =
        std::minmax_element(row_at + chunk * kChunk, row_at + std::min(width, (chunk + 1) * kChunk));
    first_row_(chunk, row) = *first;
    last_row_(chunk, row) = *last;
  }
}

/// Fills the rows [begin, end) of the surface.
void DepthSplat::collect(const Keyframe& keyframe, int begin, int end, VisibleSurface& surface) const {
  const int width = surface.nearness.width(), thrown_width = x_.width();
  const bool objects = !keyframe.object.empty();
  const auto scale = static_cast<float>(layout_.supersampling);
  const auto low = static_cast<float>(begin - 1), high = static_cast<float>(end);
  for (int row = 0; row < x_.height(); ++row) {
    for (int chunk = 0; chunk < chunks_; ++chunk) {
      if (!(last_row_(chunk, row) > low && first_row_(chunk, row) < high)) continue;
      for (int x = chunk * kChunk; x < std::min(thrown_width, (chunk + 1) * kChunk); ++x) {
        const float u = column_(x, row), v = row_(x, row);
        if (!(v > low && v < high && u > -1 && u < static_cast<float>(width))) continue;
        const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
        const float du = scale * (static_cast<float>(left) - u), dv = scale * (static_cast<float>(top) - v);
        const float inverse_z = inverse_z_(x, row);
        const float slope_x = keyframe.slope_x(x, row), slope_y = keyframe.slope_y(x, row);
        const float here = keyframe.nearness(x, row) + slope_x * du + slope_y * dv;
        const std::uint16_t object = objects ? keyframe.object(x, row) : 0;
        const auto put = [&](int column, int line, float w) {
          if (column < 0 || column >= width || line < begin || line >= end) return;
          float& there = surface.nearness(column, line);
          const float nearness = std::max(0.0F, w * inverse_z);
          if (!(nearness > there)) return;
          there = nearness;
          if (objects) surface.object(column, line) = object;
        };
        put(left, top, here);
        if (du < 0) put(left + 1, top, here + scale * slope_x);
        if (dv < 0) put(left, top + 1, here + scale * slope_y);
        if (du < 0 && dv < 0) put(left + 1, top + 1, here + scale * (slope_x + slope_y));
      }
    }
  }
}

void DepthSplat::splat(const std::vector<const Keyframe*>& keyframes, const RenderRequest& view,
                       VisibleSurface& surface) {
  const int width = layout_.sensor.width, height = layout_.sensor.height;
  if (surface.nearness.width() != width || surface.nearness.height() != height)
    surface.nearness = Image<float>(width, height);
  const bool objects = !view.objects.empty();
  if (objects && surface.object.bounds() != surface.nearness.bounds())
    surface.object = Image<std::uint16_t>(width, height);
  surface.nearness.fill(VisibleSurface::kNothing);
  if (objects) surface.object.fill(0);
  for (const Keyframe* const keyframe : keyframes) {
    const std::vector<ViewChange> changes = view_changes(keyframe->view, view);
    workers_.for_each(x_.height(), [&](int row) { throw_row(*keyframe, changes, row); });
    workers_.for_each((height + kBandRows - 1) / kBandRows, [&](int band) {
      collect(*keyframe, band * kBandRows, std::min(height, (band + 1) * kBandRows), surface);
    });
  }
}

}  // namespace esim
