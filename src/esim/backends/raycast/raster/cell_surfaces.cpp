#include "esim/backends/raycast/raster/cell_surfaces.h"

#include <bit>
#include <cmath>
#include <type_traits>

#include "esim/backends/raycast/raster/convex.h"

namespace esim::inline backends::inline raycast {
namespace {

using D = EightFloats;
constexpr int kColumns = static_cast<int>(hn::MaxLanes(D()));

/// A linear function of the bearing in all lanes, and half of its range in a pixel.
struct WideFunction {
  hn::Vec<D> x, y, one, reach;

  HWY_INLINE hn::Vec<D> at(hn::Vec<D> bearing_x, hn::Vec<D> bearing_y) const {
    return hn::MulAdd(x, bearing_x, hn::MulAdd(y, bearing_y, one));
  }
};

}  // namespace

void CellSurfaces::collect(const std::vector<PlacedGroup>& groups, const ImageCell& cell, const CellPart& part) {
  triangles_.clear();
  found_count_ = 0;
  hidden_below_.fill(0);
  ScreenLeaf projected;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const PlacedGroup& group = groups[g];
    if (!group.bounds.overlap(cell.bounds)) continue;
    leaves_.clear();
    group.triangles().tree.find(cell.bounds, group.R_group_camera, group.camera, leaves_);
    for (const auto& [leaf, met] : leaves_) {
      projected.project(*leaf, group.R_camera_group, group.camera);
      for (unsigned left = met & projected.visible; left != 0; left &= left - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(left));
        const BearingBounds bounds = projected.bounds(lane);
        if (!bounds.overlap(cell.bounds)) continue;
        ScreenTriangle triangle = projected.triangle(lane);
        triangle.group = static_cast<std::uint32_t>(g);
        triangle.index = group.first_triangle + leaf->index[lane];
        scan(triangle, bounds, cell, part);
      }
    }
  }
  sort();
}

/// Tests the pixels of the part, row by row, eight at a time.
void CellSurfaces::scan(const ScreenTriangle& triangle, const BearingBounds& bounds, const ImageCell& cell,
                        const CellPart& part) {
  const D d;
  using V = hn::Vec<D>;

  // The weights, and the inverse depth.
  const hn::FixedTag<float, 4> d4;
  const auto x4 = hn::Load(d4, triangle.x.data()), y4 = hn::Load(d4, triangle.y.data());
  const auto one4 = hn::Load(d4, triangle.one.data()), size_x = hn::Abs(x4), size_y = hn::Abs(y4);
  const auto half_range = [&](float half_width, float half_height) {
    return hn::MulAdd(size_x, hn::Set(d4, half_width), hn::Mul(size_y, hn::Set(d4, half_height)));
  };
  const BearingBounds& on = cell.bounds;
  const auto middle = hn::MulAdd(x4, hn::Set(d4, 0.5F * (on.left + on.right)),
                                 hn::MulAdd(y4, hn::Set(d4, 0.5F * (on.top + on.bottom)), one4));
  const auto in_cell = half_range(0.5F * (on.right - on.left), 0.5F * (on.bottom - on.top));
  constexpr float kRounding = 3e-7F;
  const auto error = hn::Mul(hn::Set(d4, kRounding * cell.extent), hn::Max(hn::Max(size_x, size_y), hn::Abs(one4)));
  const auto reach = hn::Add(half_range(cell.half_width, cell.half_height), error);
  if (edges_of(hn::Lt(hn::Add(middle, in_cell), hn::Neg(error))) != 0) return;
  // Edges that do not cross the cell need no tests.
  const unsigned crossing = edges_of(hn::Le(hn::Sub(middle, in_cell), reach));
  alignas(16) std::array<float, 4> reaches;
  hn::Store(reach, d4, reaches.data());
  const Range columns = cell.column.range(bounds.left, bounds.right), rows = cell.row.range(bounds.top, bounds.bottom);
  const int first_column = std::max(columns.first, part.columns.first);
  const int last_column = std::min(columns.last, part.columns.last);
  const int first_row = std::max(rows.first, part.rows.first), last_row = std::min(rows.last, part.rows.last);
  if (first_column > last_column || first_row > last_row) return;

  const auto wide = [&](std::size_t k) {
    return WideFunction{hn::Set(d, triangle.x[k]), hn::Set(d, triangle.y[k]), hn::Set(d, triangle.one[k]),
                        hn::Set(d, reaches[k])};
  };
  const WideFunction inverse_depth = wide(3);
  std::array<WideFunction, 3> edges;
  std::size_t edge_count = 0;
  for (unsigned left = crossing; left != 0; left &= left - 1)
    edges[edge_count++] = wide(static_cast<std::size_t>(std::countr_zero(left)));
  const V zero = hn::Zero(d), max = hn::Set(d, kMaxInverseDepth);
  const V min_depth = hn::Set(d, triangle.farthest), max_depth = hn::Set(d, triangle.nearest);
  const auto id = static_cast<std::uint32_t>(triangles_.size());
  const std::size_t found_before = found_count_;
  const auto scan_rows = [&](auto count) {
    for (int row = first_row; row <= last_row; ++row) {
      for (int next = first_column; next <= last_column; next += kColumns) {
        const int column = std::min(next, ImageCell::kWidth - kColumns);
        const auto k = static_cast<std::size_t>(row * ImageCell::kWidth + column);
        const V x = hn::LoadU(d, &cell.x[k]), y = hn::LoadU(d, &cell.y[k]), depth = inverse_depth.at(x, y);
        const V farthest = hn::Max(hn::Sub(depth, inverse_depth.reach), min_depth);
        const V nearest = hn::Min(hn::Add(depth, inverse_depth.reach), max_depth);
        const V hidden = hn::LoadU(d, &hidden_below_[k]);
        auto visible = hn::And(hn::Ge(nearest, hidden), hn::And(hn::Gt(nearest, zero), hn::Lt(farthest, max)));
        auto fills = hn::And(hn::Gt(farthest, zero), hn::Lt(nearest, max));
        for (std::size_t e = 0; e < count; ++e) {
          const V weight = edges[e].at(x, y);
          visible = hn::And(visible, hn::Gt(hn::Add(weight, edges[e].reach), zero));
          fills = hn::And(fills, hn::Gt(weight, edges[e].reach));
        }
        unsigned bits = bits_of(visible);
        const int skipped = next - column, kept = std::min(kColumns, last_column - column + 1);
        bits &= ((1U << kept) - 1) & ~((1U << skipped) - 1);
        if (bits == 0) continue;
        fills = hn::And(fills, visible);
        const unsigned fills_bits = bits_of(fills);
        // Only pixels that are wanted are read later.
        if (fills_bits != 0) hn::StoreU(hn::IfThenElse(fills, hn::Max(hidden, farthest), hidden), d, &hidden_below_[k]);
        if (found_.size() < found_count_ + kColumns) found_.resize(2 * found_.size() + 1024);
        alignas(64) std::array<float, 8> nearest_values;
        hn::Store(nearest, d, nearest_values.data());
        Candidate* to = &found_[found_count_];
        found_count_ += static_cast<std::size_t>(std::popcount(bits));
        for (; bits != 0; bits &= bits - 1) {
          const auto lane = static_cast<unsigned>(std::countr_zero(bits));
          *to++ = {id, nearest_values[lane], static_cast<std::uint16_t>(k + lane),
                   static_cast<std::uint16_t>(fills_bits >> lane & 1U)};
        }
      }
    }
  };
  if (edge_count == 0) {
    scan_rows(std::integral_constant<std::size_t, 0>());
  } else if (edge_count == 1) {
    scan_rows(std::integral_constant<std::size_t, 1>());
  } else if (edge_count == 2) {
    scan_rows(std::integral_constant<std::size_t, 2>());
  } else {
    scan_rows(std::integral_constant<std::size_t, 3>());
  }
  if (found_count_ > found_before) triangles_.push_back(triangle);
}

/// By pixel, without those that are hidden.
void CellSurfaces::sort() {
  const std::span<const Candidate> found = std::span(found_).first(found_count_);
  const auto is_hidden = [&](const Candidate& candidate) { return candidate.nearest < hidden_below_[candidate.pixel]; };
  begin_.fill(0);
  for (const Candidate& candidate : found) begin_[candidate.pixel + 1U] += is_hidden(candidate) ? 0 : 1;
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  if (sorted_.size() < begin_.back()) sorted_.resize(2 * begin_.back());
  std::array<std::uint32_t, ImageCell::kPixels> next;
  std::copy_n(begin_.begin(), next.size(), next.begin());
  for (const Candidate& candidate : found) {
    if (!is_hidden(candidate)) sorted_[next[candidate.pixel]++] = candidate;
  }
}

}  // namespace esim::inline backends::inline raycast
