#include "esim/reproject/depth_splat.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "esim/core/error.h"
#include "esim/reproject/lens.h"

namespace esim::inline reproject {
namespace {

/// Bits of a key in a band, below those of the nearness: an edge, and above it a rank.
constexpr int kEdgeBits = 2;
constexpr std::uint32_t kFirstRank = (1U << (32 - kEdgeBits)) - 1;

std::uint32_t rank_of(std::uint64_t key) { return static_cast<std::uint32_t>(key) >> kEdgeBits; }

}  // namespace

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

void VisibleSurface::resize(int width, int height, bool objects) {
  if (nearness.width() != width || nearness.height() != height) {
    nearness = Image<float>(width, height);
    edge = Image<Edge>(width, height);
  }
  if (objects && object.bounds() != nearness.bounds()) object = Image<std::uint16_t>(width, height);
}

DepthSplat::DepthSplat(Camera camera, int scale, double greatest_radius, const Workers& workers)
    : camera_(std::move(camera)),
      scale_(static_cast<float>(scale)),
      greatest_radius_(greatest_radius),
      workers_(workers) {}

/// Projects the points of a run.
void DepthSplat::project(const SurfacePoints& points, const std::vector<ViewChange>& changes, int run,
                         Projected& projected) const {
  const int begin = run * kRun, end = std::min(points.size(), (run + 1) * kRun);
  const std::uint16_t* const object = points.object.empty() ? nullptr : points.object.data();
  const float *const bx = points.x.data(), *const by = points.y.data(), *const w = points.nearness.data();
  float *const column_at = projected.column.data(), *const row_at = projected.row.data(),
               *const inverse_z = projected.inverse_z.data();

  std::visit(
      [&](const auto& model) {
        const Projector to_pixel(camera_, model, greatest_radius_);
        for (int first = begin; first < end;) {
          // Consecutive points of the same object.
          int last = object == nullptr ? end : first + 1;
          while (last < end && object[last] == object[first]) ++last;
          const ViewChange c = changes[object == nullptr ? 0 : object[first]];
          const float r00 = c.R(0, 0), r01 = c.R(0, 1), r02 = c.R(0, 2), r10 = c.R(1, 0), r11 = c.R(1, 1),
                      r12 = c.R(1, 2), r20 = c.R(2, 0), r21 = c.R(2, 1), r22 = c.R(2, 2);
          const float t0 = c.t.x(), t1 = c.t.y(), t2 = c.t.z();
#pragma omp simd
          for (int i = first; i < last; ++i) {
            const float y0 = r00 * bx[i] + r01 * by[i] + r02 + w[i] * t0;
            const float y1 = r10 * bx[i] + r11 * by[i] + r12 + w[i] * t1;
            const float y2 = r20 * bx[i] + r21 * by[i] + r22 + w[i] * t2;
            float u, v;
            to_pixel(y0, y1, y2, u, v);
            column_at[i] = u;
            row_at[i] = v;
            inverse_z[i] = 1.0F / y2;
          }
          first = last;
        }
      },
      camera_.distortion);

  Rows& of_run = projected.runs[static_cast<std::size_t>(run)];
  of_run = {row_at[begin], row_at[begin]};
  for (int first = begin; first < end; first += kChunk) {
    Rows& chunk = projected.chunks[static_cast<std::size_t>(first / kChunk)];
    chunk = {row_at[first], row_at[first]};
    for (int i = first; i < std::min(end, first + kChunk); ++i)
      chunk = {std::min(chunk.first, row_at[i]), std::max(chunk.last, row_at[i])};
    of_run = {std::min(of_run.first, chunk.first), std::max(of_run.last, chunk.last)};
  }
}

/// Collects the points that fall into the rows [begin, end).
void DepthSplat::collect(const SurfacePoints& points, const Projected& projected, int begin, int end,
                         Band& band) const {
  const auto low = static_cast<float>(begin - 1), high = static_cast<float>(end);
  const auto reaches = [&](const Rows& rows) { return rows.last > low && rows.first < high; };
  for (std::size_t run = 0; run < projected.runs.size(); ++run) {
    if (!reaches(projected.runs[run])) continue;
    const std::size_t last = std::min(projected.chunks.size(), (run + 1) * kChunksOfRun);
    for (std::size_t chunk = run * kChunksOfRun; chunk < last; ++chunk)
      if (reaches(projected.chunks[chunk])) collect_chunk(points, projected, chunk * kChunk, begin, end, band);
  }
}

void DepthSplat::collect_chunk(const SurfacePoints& points, const Projected& projected, std::size_t first, int begin,
                               int end, Band& band) const {
  const int count = static_cast<int>(std::min(projected.column.size() - first, std::size_t{kChunk}));
  const int stride = camera_.width + 2;
  const auto low = static_cast<float>(begin - 1), high = static_cast<float>(end);
  const auto width = static_cast<float>(camera_.width);
  const float *const column = projected.column.data() + first, *const row = projected.row.data() + first,
                     *const inverse_z = projected.inverse_z.data() + first;
  const float *const nearness = points.nearness.data() + first, *const slope_x = points.slope_x.data() + first,
                     *const slope_y = points.slope_y.data() + first;
  const Edge* const edge = points.edge.data() + first;
  const std::uint32_t rank = kFirstRank - (projected.before + static_cast<std::uint32_t>(first));
  const float scale = scale_;

  // Of each point: its first place in the band or -1, and halves of the keys there, to the right, below, and right
  // below
  std::array<std::int32_t, kChunk> at;
  std::array<std::array<std::uint32_t, kChunk>, 4> near, mark;
#pragma omp simd
  for (int i = 0; i < count; ++i) {
    const bool inside = row[i] > low && row[i] < high && column[i] > -1 && column[i] < width;
    const float u = inside ? column[i] : 0.0F, v = inside ? row[i] : 0.0F;
    const float left = std::floor(u), top = std::floor(v);
    const float du = scale * (left - u), dv = scale * (top - v);
    const float here = nearness[i] + slope_x[i] * du + slope_y[i] * dv;
    const auto seen = [&](bool there, float w) {
      return there ? std::bit_cast<std::uint32_t>(std::max(0.0F, w * inverse_z[i])) : 0U;
    };
    at[i] = inside ? (static_cast<int>(top) - begin + 1) * stride + static_cast<int>(left) + 1 : -1;
    near[0][i] = seen(true, here);
    near[1][i] = seen(du < 0, here + scale * slope_x[i]);
    near[2][i] = seen(dv < 0, here + scale * slope_y[i]);
    near[3][i] = seen(du < 0 && dv < 0, here + scale * (slope_x[i] + slope_y[i]));
    // An outline marks all pixels that its point covers, a crease only the pixel of its point.
    const auto kind = static_cast<std::uint32_t>(edge[i]), key = (rank - static_cast<std::uint32_t>(i)) << kEdgeBits;
    const bool crease = edge[i] == Edge::crease;
    const bool after_x = std::fabs(left - u) > 0.5F, after_y = std::fabs(top - v) > 0.5F;
    const bool before_x = std::fabs(left + 1 - u) > 0.5F, before_y = std::fabs(top + 1 - v) > 0.5F;
    const auto marked = [&](bool there, bool beside) { return there ? key | (crease && beside ? 0U : kind) : 0U; };
    mark[0][i] = marked(true, after_x || after_y);
    mark[1][i] = marked(du < 0, before_x || after_y);
    mark[2][i] = marked(dv < 0, after_x || before_y);
    mark[3][i] = marked(du < 0 && dv < 0, before_x || before_y);
  }
  for (int i = 0; i < count; ++i) {
    if (at[i] < 0) continue;
    std::uint64_t* const there = band.data() + at[i];
    const auto put = [&](std::uint64_t& place, int corner) {
      place = std::max(place, std::uint64_t{near[corner][i]} << 32 | mark[corner][i]);
    };
    put(there[0], 0), put(there[1], 1);
    put(there[stride], 2), put(there[stride + 1], 3);
  }
}

/// The object of a point, counted through all keyframes.
std::uint16_t DepthSplat::object_of(const std::vector<SeenPoints>& keyframes, std::uint32_t point) const {
  std::size_t of = keyframes.size() - 1;
  while (projected_[of].before > point) --of;
  const std::vector<std::uint16_t>& objects = keyframes[of].points.object;
  return objects.empty() ? std::uint16_t{0} : objects[point - projected_[of].before];
}

/// Fills the rows [begin, end) of the surface.
void DepthSplat::show(const std::vector<SeenPoints>& keyframes, bool objects, const Band& band, int begin, int end,
                      VisibleSurface& surface) const {
  const int width = camera_.width;
  for (int y = begin; y < end; ++y) {
    const std::uint64_t* const keys = band.data() + static_cast<std::size_t>(y - begin + 1) * (width + 2) + 1;
    float* const nearness = surface.nearness.row(y);
    Edge* const edge = surface.edge.row(y);
#pragma omp simd
    for (int x = 0; x < width; ++x) {
      const float seen = std::bit_cast<float>(static_cast<std::uint32_t>(keys[x] >> 32));
      nearness[x] = keys[x] == 0 ? VisibleSurface::kNothing : seen;
      edge[x] = static_cast<Edge>(keys[x] & ((1U << kEdgeBits) - 1));
    }
    if (!objects) continue;
    for (int x = 0; x < width; ++x)
      surface.object(x, y) = keys[x] == 0 ? std::uint16_t{0} : object_of(keyframes, kFirstRank - rank_of(keys[x]));
  }
}

void DepthSplat::splat(const std::vector<SeenPoints>& keyframes, const RenderRequest& view, VisibleSurface& surface) {
  const int width = camera_.width, height = camera_.height;
  const bool objects = !view.objects.empty();
  surface.resize(width, height, objects);
  projected_.resize(keyframes.size());
  std::uint32_t before = 0;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const SurfacePoints& points = keyframes[k].points;
    const auto count = static_cast<std::uint32_t>(points.size());
    if (count >= kFirstRank - before)
      throw UserError("keyframes: their images have more than 2^30 pixels; choose a smaller supersampling or margin");
    Projected& projected = projected_[k];
    projected.before = std::exchange(before, before + count);
    for (std::vector<float>* values : {&projected.column, &projected.row, &projected.inverse_z}) values->resize(count);
    projected.chunks.resize((count + kChunk - 1) / kChunk), projected.runs.resize((count + kRun - 1) / kRun);
    const std::vector<ViewChange> changes = view_changes(keyframes[k].view, view);
    workers_.for_each(static_cast<int>(projected.runs.size()),
                      [&](int run) { project(points, changes, run, projected); });
  }
  bands_.resize(static_cast<std::size_t>(workers_.threads()));
  workers_.for_each_with_worker((height + kBandRows - 1) / kBandRows, [&](int number, int worker) {
    const int begin = number * kBandRows, end = std::min(height, begin + kBandRows);
    Band& band = bands_[static_cast<std::size_t>(worker)];
    band.assign(static_cast<std::size_t>((kBandRows + 2) * (width + 2)), 0);
    for (std::size_t k = 0; k < keyframes.size(); ++k) collect(keyframes[k].points, projected_[k], begin, end, band);
    show(keyframes, objects, band, begin, end, surface);
  });
}

}  // namespace esim::inline reproject
