#include "esim/reproject/depth_splat.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "esim/core/error.h"
#include "esim/reproject/lens.h"
#include "esim/reproject/lookup_lanes.h"

namespace esim::inline reproject {
namespace {

/// Bits of a key in a band, below those of the nearness: an edge, and above it a rank.
constexpr int kEdgeBits = 2;
constexpr std::uint32_t kFirstRank = (1U << (32 - kEdgeBits)) - 1;

std::uint32_t rank_of(std::uint64_t key) { return static_cast<std::uint32_t>(key) >> kEdgeBits; }

}  // namespace

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

/// Projects the points of a run.
void DepthSplat::project(const SurfacePoints& points, const std::vector<ViewChange>& changes, int run,
                         Projected& projected) const {
  const int begin = run * kRun, end = std::min(points.size(), (run + 1) * kRun);
  const std::uint16_t* const part = points.part.empty() ? nullptr : points.part.data();
  const float *const bx = points.x.data(), *const by = points.y.data(), *const w = points.nearness.data();
  float *const column_at = projected.column.data(), *const row_at = projected.row.data(),
               *const inverse_z = projected.inverse_z.data();

  std::visit(
      [&](const auto& model) {
        const Projector to_pixel(camera_, model, greatest_radius_);
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
  const std::size_t last = std::min(projected.column.size(), first + kChunk);
  const int stride = camera_.width + 2;
  const hn::Rebind<std::uint32_t, LookupTag> whole;
  const hn::RebindToSigned<LookupTag> integers;
  const auto all = [](float value) { return hn::Set(kLookupTag, value); };
  for (std::size_t i = first; i < last; i += kLookupLanes) {
    const auto load = [&](const auto& values) { return load_some(values.data() + i, last - i); };
    const LookupLanes column = load(projected.column), row = load(projected.row);
    const auto inside =
        hn::And(hn::And(hn::Gt(row, all(static_cast<float>(begin - 1))), hn::Lt(row, all(static_cast<float>(end)))),
                hn::And(hn::Gt(column, all(-1)), hn::Lt(column, all(static_cast<float>(camera_.width)))));
    if (hn::AllFalse(kLookupTag, inside)) continue;

    // The nearness at the four places around the point, of which those to the right and below may be missing
    const LookupLanes u = hn::IfThenElseZero(inside, column), v = hn::IfThenElseZero(inside, row);
    const LookupLanes left = hn::Floor(u), top = hn::Floor(v);
    const LookupLanes du = hn::Mul(all(scale_), hn::Sub(left, u)), dv = hn::Mul(all(scale_), hn::Sub(top, v));
    const LookupLanes slope_x = load(points.slope_x), slope_y = load(points.slope_y),
                      inverse_z = load(projected.inverse_z);
    const LookupLanes here = hn::MulAdd(slope_y, dv, hn::MulAdd(slope_x, du, load(points.nearness)));
    const auto right = hn::Lt(du, hn::Zero(kLookupTag)), below = hn::Lt(dv, hn::Zero(kLookupTag));

    // An outline marks all pixels that its point covers, a crease only the pixel of its point.
    const auto edge =
        hn::PromoteTo(whole, load_some(reinterpret_cast<const std::uint8_t*>(points.edge.data()) + i, last - i));
    const auto crease = hn::Eq(edge, hn::Set(whole, static_cast<std::uint32_t>(Edge::crease)));
    const auto apart = [&](LookupLanes a, LookupLanes b) { return hn::Gt(hn::Abs(hn::Sub(a, b)), all(0.5F)); };
    const LookupLanes next_left = hn::Add(left, all(1)), next_top = hn::Add(top, all(1));
    const auto left_apart = apart(left, u), top_apart = apart(top, v), right_apart = apart(next_left, u),
               below_apart = apart(next_top, v);

    const auto rank = static_cast<std::uint32_t>(kFirstRank - (projected.before + i));
    const auto ranks = hn::ShiftLeft<kEdgeBits>(hn::Sub(hn::Set(whole, rank), hn::Iota(whole, 0)));
    std::array<std::array<std::uint64_t, kLookupLanes>, 4> keys;
    const auto set = [&](std::size_t corner, auto there, LookupLanes w, auto beside) {
      const LookupLanes seen = hn::Mul(w, inverse_z);
      const auto near = hn::IfThenElseZero(hn::And(there, hn::Gt(seen, hn::Zero(kLookupTag))), seen);
      const auto marked = hn::Or(ranks, hn::IfThenZeroElse(hn::And(crease, hn::RebindMask(whole, beside)), edge));
      store_pairs(hn::BitCast(whole, near), hn::IfThenElseZero(hn::RebindMask(whole, there), marked),
                  keys[corner].data());
    };
    set(0, inside, here, hn::Or(left_apart, top_apart));
    set(1, right, hn::MulAdd(all(scale_), slope_x, here), hn::Or(right_apart, top_apart));
    set(2, below, hn::MulAdd(all(scale_), slope_y, here), hn::Or(left_apart, below_apart));
    set(3, hn::And(right, below), hn::MulAdd(all(scale_), hn::Add(slope_x, slope_y), here),
        hn::Or(right_apart, below_apart));

    alignas(32) std::array<std::int32_t, kLookupLanes> at;
    const auto line = hn::Sub(hn::ConvertTo(integers, top), hn::Set(integers, begin - 1));
    hn::Store(
        hn::Add(hn::Add(hn::Mul(line, hn::Set(integers, stride)), hn::ConvertTo(integers, left)), hn::Set(integers, 1)),
        integers, at.data());
    std::array<std::uint8_t, 8> bits;
    hn::StoreMaskBits(kLookupTag, inside, bits.data());
    for (unsigned rest = bits[0]; rest != 0; rest &= rest - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(rest));
      std::uint64_t* const there = band.data() + at[lane];
      const auto put = [&](std::uint64_t& place, std::size_t corner) { place = std::max(place, keys[corner][lane]); };
      put(there[0], 0), put(there[1], 1);
      put(there[stride], 2), put(there[stride + 1], 3);
    }
  }
}

/// The part of a point, counted through all keyframes.
std::uint16_t DepthSplat::part_of(const std::vector<SeenPoints>& keyframes, std::uint32_t point) const {
  std::size_t of = keyframes.size() - 1;
  while (projected_[of].before > point) --of;
  const std::vector<std::uint16_t>& parts = keyframes[of].points.part;
  return parts.empty() ? std::uint16_t{0} : parts[point - projected_[of].before];
}

/// Fills the rows [begin, end) of the surface.
void DepthSplat::show(const std::vector<SeenPoints>& keyframes, bool moves, const Band& band, int begin, int end,
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
    if (!moves) continue;
    for (int x = 0; x < width; ++x)
      surface.part(x, y) = keys[x] == 0 ? std::uint16_t{0} : part_of(keyframes, kFirstRank - rank_of(keys[x]));
  }
}

void DepthSplat::splat(const std::vector<SeenPoints>& keyframes, bool moves, VisibleSurface& surface) {
  const int width = camera_.width, height = camera_.height;
  surface.resize(width, height, moves);
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
    const std::vector<ViewChange>& changes = keyframes[k].changes;
    workers_.for_each(static_cast<int>(projected.runs.size()),
                      [&](int run) { project(points, changes, run, projected); });
  }
  bands_.resize(static_cast<std::size_t>(workers_.threads()));
  workers_.for_each_with_worker((height + kBandRows - 1) / kBandRows, [&](int number, int worker) {
    const int begin = number * kBandRows, end = std::min(height, begin + kBandRows);
    Band& band = bands_[static_cast<std::size_t>(worker)];
    band.assign(static_cast<std::size_t>((kBandRows + 2) * (width + 2)), 0);
    for (std::size_t k = 0; k < keyframes.size(); ++k) collect(keyframes[k].points, projected_[k], begin, end, band);
    show(keyframes, moves, band, begin, end, surface);
  });
}

}  // namespace esim::inline reproject
