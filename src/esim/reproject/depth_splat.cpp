#include "esim/reproject/depth_splat.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "esim/reproject/lens.h"

namespace esim::inline reproject {

void VisibleSurface::resize(int width, int height, bool moves) {
  if (nearness.width() != width || nearness.height() != height) {
    nearness = Image<float>(width, height);
    edge = Image<Edge>(width, height);
  }
  if (moves && part.bounds() != nearness.bounds()) part = Image<std::uint16_t>(width, height);
}

DepthSplat::DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers)
    : camera_(std::move(camera)),
      scale_(static_cast<float>(scale)),
      greatest_radius_(greatest_radius),
      workers_(workers) {}

void DepthSplat::resize(int points) {
  for (std::vector<float>* values : {&column_, &row_, &inverse_z_}) values->resize(static_cast<std::size_t>(points));
  for (std::vector<float>* values : {&first_row_, &last_row_})
    values->resize(static_cast<std::size_t>((points + kChunk - 1) / kChunk));
}

/// Projects the points [begin, end); `begin` must be the first of a chunk.
void DepthSplat::throw_run(const SurfacePoints& points, const std::vector<ViewChange>& changes, int begin, int end) {
  const std::uint16_t* const part = points.part.empty() ? nullptr : points.part.data();
  const float *const bx = points.x.data(), *const by = points.y.data(), *const w = points.nearness.data();
  float *const column_at = column_.data(), *const row_at = row_.data(), *const inverse_z = inverse_z_.data();

  std::visit(
      [&](const auto& model) {
        const Projector project(camera_, model, greatest_radius_);
        for (int first = begin; first < end;) {
          // Consecutive points of the same part.
          int last = part == nullptr ? end : first + 1;
          while (last < end && part[last] == part[first]) ++last;
          const ViewChange c = changes[part == nullptr ? 0 : part[first]];
          const float r00 = c.R(0, 0), r01 = c.R(0, 1), r02 = c.R(0, 2), r10 = c.R(1, 0), r11 = c.R(1, 1),
                      r12 = c.R(1, 2), r20 = c.R(2, 0), r21 = c.R(2, 1), r22 = c.R(2, 2);
          const float t0 = c.t.x(), t1 = c.t.y(), t2 = c.t.z();
#pragma omp simd
          for (int i = first; i < last; ++i) {
            const float y0 = r00 * bx[i] + r01 * by[i] + r02 + w[i] * t0;
            const float y1 = r10 * bx[i] + r11 * by[i] + r12 + w[i] * t1;
            const float y2 = r20 * bx[i] + r21 * by[i] + r22 + w[i] * t2;
            float u, v;
            project(y0, y1, y2, u, v);
            column_at[i] = u;
            row_at[i] = v;
            inverse_z[i] = 1.0F / y2;
          }
          first = last;
        }
      },
      camera_.distortion);

  for (int first = begin; first < end; first += kChunk) {
    const auto [lowest, highest] = std::minmax_element(row_at + first, row_at + std::min(end, first + kChunk));
    first_row_[static_cast<std::size_t>(first / kChunk)] = *lowest;
    last_row_[static_cast<std::size_t>(first / kChunk)] = *highest;
  }
}

/// Fills the rows [begin, end) of the surface.
void DepthSplat::collect(const SurfacePoints& points, int begin, int end, VisibleSurface& surface) const {
  const int width = surface.nearness.width();
  const bool moves = !points.part.empty();
  const auto low = static_cast<float>(begin - 1), high = static_cast<float>(end);
  for (std::size_t chunk = 0; chunk < first_row_.size(); ++chunk) {
    if (!(last_row_[chunk] > low && first_row_[chunk] < high)) continue;
    const std::size_t last = std::min(column_.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < last; ++i) {
      const float u = column_[i], v = row_[i];
      if (!(v > low && v < high && u > -1 && u < static_cast<float>(width))) continue;
      const int left = static_cast<int>(std::floor(u)), top = static_cast<int>(std::floor(v));
      const float du = scale_ * (static_cast<float>(left) - u), dv = scale_ * (static_cast<float>(top) - v);
      const float inverse_z = inverse_z_[i], slope_x = points.slope_x[i], slope_y = points.slope_y[i];
      const float here = points.nearness[i] + slope_x * du + slope_y * dv;
      const std::uint16_t part = moves ? points.part[i] : 0;
      const auto put = [&](int column, int line, float w) {
        if (column < 0 || column >= width || line < begin || line >= end) return;
        float& there = surface.nearness(column, line);
        const float nearness = std::max(0.0F, w * inverse_z);
        if (!(nearness > there)) return;
        there = nearness;
        if (moves) surface.part(column, line) = part;
        // An outline marks all pixels that its point covers, a crease only the pixel of its point.
        const auto apart = [](int a, float b) { return std::fabs(static_cast<float>(a) - b) > 0.5F; };
        const bool beside = points.edge[i] == Edge::crease && (apart(column, u) || apart(line, v));
        surface.edge(column, line) = beside ? Edge::none : points.edge[i];
      };
      put(left, top, here);
      if (du < 0) put(left + 1, top, here + scale_ * slope_x);
      if (dv < 0) put(left, top + 1, here + scale_ * slope_y);
      if (du < 0 && dv < 0) put(left + 1, top + 1, here + scale_ * (slope_x + slope_y));
    }
  }
}

void DepthSplat::splat(const std::vector<SeenPoints>& keyframes, bool moves, VisibleSurface& surface) {
  const int width = camera_.width, height = camera_.height;
  surface.resize(width, height, moves);
  surface.nearness.fill(VisibleSurface::kNothing);
  surface.edge.fill(Edge::none);
  if (moves) surface.part.fill(0);
  for (const SeenPoints& keyframe : keyframes) {
    const SurfacePoints& points = keyframe.points;
    resize(points.size());
    workers_.for_each((points.size() + kRun - 1) / kRun, [&](int run) {
      throw_run(points, keyframe.changes, run * kRun, std::min(points.size(), (run + 1) * kRun));
    });
    workers_.for_each((height + kBandRows - 1) / kBandRows, [&](int band) {
      collect(points, band * kBandRows, std::min(height, (band + 1) * kBandRows), surface);
    });
  }
}

}  // namespace esim::inline reproject
