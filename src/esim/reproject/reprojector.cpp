#include "esim/reproject/reprojector.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "esim/reproject/lens.h"
#include "esim/reproject/row_lookup.h"

namespace esim::inline reproject {
namespace {

double greatest_radius(const PixelRays& rays) {
  double longest = 0;
  for (int y = 0; y < rays.x.height(); ++y)
    for (int x = 0; x < rays.x.width(); ++x)
      longest = std::max(longest, std::hypot(double{rays.x(x, y)}, double{rays.y(x, y)}));
  return longest * (1 + 1e-5);
}

/// Weight of the later keyframe; strictly between 0 and 1, because the other keyframe may not see a pixel.
float share_of_later(const Keyframe& before, const Keyframe& after, TimeNs t) {
  const TimeNs interval = after.view.t - before.view.t;
  const double share = interval > 0 ? static_cast<double>(t - before.view.t) / static_cast<double>(interval) : 0.0;
  return static_cast<float>(std::clamp(share, 1e-4, 1 - 1e-4));
}

/// Fills pixels without a keyframe point with the farther of the adjacent surfaces.
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

/// Several points in a row of the view: bearings (x, y, 1), nearness and, if objects move, the part of each.
struct RowPoints {
  const float *x, *y, *nearness;
  const std::uint16_t* part;
  int count;
};

/// Calls body(begin, end, part) for each run of points on the same part.
template <typename Body>
void for_each_run(const RowPoints& points, const Body& body) {
  for (int begin = 0; begin < points.count;) {
    int end = points.part != nullptr ? begin + 1 : points.count;
    while (end < points.count && points.part[end] == points.part[begin]) ++end;
    body(begin, end, points.part != nullptr ? points.part[begin] : 0);
    begin = end;
  }
}

}  // namespace

/// Two keyframes and a view between them.
struct Reprojector::Between {
  Between(const Keyframe& first, const Keyframe& second, const RenderRequest& seen_from, const SceneParts& parts)
      : before(first), after(second), view(seen_from), share(share_of_later(before, after, view.t)) {
    std::vector<std::uint16_t> wanted;
    std::set_union(before.deforming.begin(), before.deforming.end(), after.deforming.begin(), after.deforming.end(),
                   std::back_inserter(wanted));
    const PlacedTriangles then = parts.place(before.view, wanted), now = parts.place(view, wanted),
                          later = parts.place(after.view, wanted);
    from_before = parts.changes(then, now), from_after = parts.changes(later, now);
    to_before = parts.changes(now, then), to_after = parts.changes(now, later);
  }

  const Keyframe &before, &after;
  const RenderRequest& view;
  std::vector<ViewChange> from_before, from_after, to_before, to_after;  // by part
  float share;                                                           // weight of `after`

  template <typename Model>
  void project(const Projector<Model>& project, const RowPoints& points, RowLookup& in_before,
               RowLookup& in_after) const {
    for_each_run(points, [&](int begin, int end, std::size_t part) {
      project_row(project, to_before[part], points.x, points.y, points.nearness, begin, end, in_before);
      project_row(project, to_after[part], points.x, points.y, points.nearness, begin, end, in_after);
    });
  }

  /// E of the points; from both keyframes if neither sees one.
  void blend(const RowLookup& in_before, const RowLookup& in_after, float* light) const {
    const float *const seen0 = in_before.seen.data(), *const seen1 = in_after.seen.data();
    const float *const value0 = in_before.value.data(), *const value1 = in_after.value.data();
#pragma omp simd
    for (std::size_t i = 0; i < in_before.count; ++i) {
      const bool neither = seen0[i] + seen1[i] == 0;
      const float w0 = (1 - share) * (neither ? 1.0F : seen0[i]);
      const float w1 = share * (neither ? 1.0F : seen1[i]);
      light[i] = (w0 * value0[i] + w1 * value1[i]) / (w0 + w1);
    }
  }
};

Reprojector::Reprojector(const KeyframeLayout& layout, bool at_infinity, const Workers& workers, SceneParts parts)
    : layout_(layout),
      parts_(std::move(parts)),
      at_infinity_(at_infinity),
      rays_(layout.sensor),
      keyframe_rays_(layout.camera),
      greatest_radius_(greatest_radius(keyframe_rays_)),
      workers_(workers),
      splat_(layout.sensor, layout.supersampling, greatest_radius_, workers),
      cells_(layout, greatest_radius_, workers) {
  surface_.resize(layout.sensor.width, layout.sensor.height, false);  // initially everything is at infinity
}

void Reprojector::prepare(RenderRequest view, const Sample& sample, KeyframeLight light, Keyframe& keyframe) const {
  prepare_keyframe(layout_, keyframe_rays_, parts_, at_infinity_, std::move(view), sample, std::move(light), workers_,
                   keyframe);
}

void Reprojector::reconstruct(const Keyframe& before, const Keyframe& after, const RenderRequest& view, Detail detail,
                              Reconstruction& result) {
  const int width = layout_.sensor.width, height = layout_.sensor.height;
  const auto fit = [&](Image<float>& image) {
    if (image.width() != width || image.height() != height) image = Image<float>(width, height);
  };
  fit(result.irradiance);
  if (detail == Detail::apart) fit(result.from_before), fit(result.from_after);
  const bool closely = detail == Detail::whole && before.dense.size() + after.dense.size() > 0;
  const Between between(before, after, view, parts_);
  const bool moves = !view.objects.empty();
  if (closely) {
    cells_.look({{before.dense, between.from_before}, {after.dense, between.from_after}}, moves, surface_);
  } else if (!at_infinity_) {
    splat_.splat({{before.sparse, between.from_before}, {after.sparse, between.from_after}}, moves, surface_);
  }
  std::visit(
      [&](const auto& model) {
        look_up(between, model, detail, result);
        if (closely) refine(between, model, result);
      },
      layout_.camera.distortion);
}

/// Looks up every pixel at its centre.
template <typename Model>
void Reprojector::look_up(const Between& between, const Model& model, Detail detail, Reconstruction& result) {
  const int width = layout_.sensor.width, height = layout_.sensor.height;
  const Projector project(layout_.camera, model, greatest_radius_);
  const bool objects = !between.view.objects.empty() && !at_infinity_;
  std::vector<std::int64_t> unseen(static_cast<std::size_t>(height));
  workers_.for_each(height, [&](int y) {
    RowLookup row0(static_cast<std::size_t>(width)), row1(static_cast<std::size_t>(width));
    float* const w = surface_.nearness.row(y);
    fill_gaps(w, width);
    between.project(project, {rays_.x.row(y), rays_.y.row(y), w, objects ? surface_.part.row(y) : nullptr, width}, row0,
                    row1);
    const auto look = [&](const Keyframe& keyframe, RowLookup& row) {
      at_infinity_ ? look_up_row<false>(keyframe.wide, row) : look_up_row<true>(keyframe.wide, row);
    };
    look(between.before, row0);
    look(between.after, row1);
    between.blend(row0, row1, result.irradiance.row(y));
    const float *const seen0 = row0.seen.data(), *const seen1 = row1.seen.data();
    Edge* const edge = surface_.edge.row(y);
    int hidden = 0;
#pragma omp simd reduction(+ : hidden)
    for (int x = 0; x < width; ++x) {
      const bool is_hidden = seen0[x] + seen1[x] == 0;
      hidden += is_hidden;
      edge[x] = is_hidden ? Edge::outline : edge[x];  // it is next to an outline, for both keyframes
    }
    unseen[static_cast<std::size_t>(y)] = hidden;
    if (detail != Detail::apart) return;
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(x);
      result.from_before(x, y) = row0.seen[i] > 0 ? row0.value[i] : -1.0F;
      result.from_after(x, y) = row1.seen[i] > 0 ? row1.value[i] : -1.0F;
    }
  });
  result.unseen = std::accumulate(unseen.begin(), unseen.end(), std::int64_t{0});
}

/// Looks up the pixels at edges, and those hidden from both keyframes by the blur of edges, at supersampling^2 places
/// each. Places that neither keyframe sees count only if the pixel has no others.
template <typename Model>
void Reprojector::refine(const Between& between, const Model& model, Reconstruction& result) {
  const int s = layout_.supersampling, margin = s * layout_.margin_px, places = s * s;
  const Projector project(layout_.camera, model, greatest_radius_);
  const bool objects = !between.view.objects.empty();
  workers_.for_each(layout_.sensor.height, [&](int y) {
    std::vector<int> pixels;
    for (int x = 0; x < layout_.sensor.width; ++x)
      if (surface_.edge(x, y) != Edge::none) pixels.push_back(x);
    const std::size_t count = pixels.size() * static_cast<std::size_t>(places);
    std::vector<float> bx(count), by(count), w(count), light(count);
    std::vector<std::uint16_t> part(objects ? count : 0);
    std::size_t at = 0;
    for (const int x : pixels) {
      for (int j = s * y; j < s * (y + 1); ++j) {
        for (int i = s * x; i < s * (x + 1); ++i, ++at) {
          bx[at] = keyframe_rays_.x(i + margin, j + margin), by[at] = keyframe_rays_.y(i + margin, j + margin);
          const Cells::Seen seen = cells_.at(i, j);
          const bool nothing = seen.nearness < 0;  // no point falls into the cell
          w[at] = nothing ? surface_.nearness(x, y) : seen.nearness;
          if (objects) part[at] = nothing ? surface_.part(x, y) : seen.part;
        }
      }
    }
    RowLookup row0(count), row1(count);
    between.project(project, {bx.data(), by.data(), w.data(), objects ? part.data() : nullptr, static_cast<int>(count)},
                    row0, row1);
    look_up_row<true>(between.before.narrow, row0);
    look_up_row<true>(between.after.narrow, row1);
    between.blend(row0, row1, light.data());
    at = 0;
    for (const int x : pixels) {
      float seen = 0, all = 0, seen_places = 0;
      for (int place = 0; place < places; ++place, ++at) {
        all += light[at];
        if (row0.seen[at] + row1.seen[at] > 0) seen += light[at], seen_places += 1;
      }
      result.irradiance(x, y) = seen_places > 0 ? seen / seen_places : all / static_cast<float>(places);
    }
  });
}

}  // namespace esim::inline reproject
