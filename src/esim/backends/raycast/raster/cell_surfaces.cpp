#include "esim/backends/raycast/raster/cell_surfaces.h"

#include <bit>
#include <cmath>

#include "esim/backends/raycast/raster/convex.h"

namespace esim::inline backends::inline raycast {
namespace {

using D = EightFloats;
constexpr int kColumns = static_cast<int>(hn::MaxLanes(D()));

/// A linear function on a rectangle of bearings: its value in the middle, and how much it differs at most.
struct OnRectangle {
  float middle, reach;

  OnRectangle(const OfBearing& f, const BearingBounds& on)
      : middle(f.at(0.5F * (on.left + on.right), 0.5F * (on.top + on.bottom))),
        reach(0.5F * (std::fabs(f.x) * (on.right - on.left) + std::fabs(f.y) * (on.bottom - on.top))) {}
};

/// Bound of the rounding error of f at a bearing of the cell.
float rounding(const OfBearing& f, float extent) {
  constexpr float kRounding = 3e-7F;
  return kRounding * extent * std::max(std::max(std::fabs(f.x), std::fabs(f.y)), std::fabs(f.one));
}

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

  // Edges that do not cross the cell need no tests.
  struct Edge {
    OfBearing weight;
    float reach;  // half of the range of the weight in a pixel
  };
  std::array<Edge, 3> edges;
  std::size_t edge_count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const OfBearing weight = triangle.weight(k);
    const OnRectangle range(weight, cell.bounds);
    const float error = rounding(weight, cell.extent);
    if (range.middle + range.reach < -error) return;
    const float reach = std::fabs(weight.x) * cell.half_width + std::fabs(weight.y) * cell.half_height + error;
    if (range.middle - range.reach > reach) continue;
    edges[edge_count++] = {weight, reach};
  }
  const Range columns = cell.column.range(bounds.left, bounds.right), rows = cell.row.range(bounds.top, bounds.bottom);
  const int first_column = std::max(columns.first, part.columns.first);
  const int last_column = std::min(columns.last, part.columns.last);
  const int first_row = std::max(rows.first, part.rows.first), last_row = std::min(rows.last, part.rows.last);
  if (first_column > last_column || first_row > last_row) return;

  const OfBearing z = triangle.inverse_depth();
  const float z_reach = std::fabs(z.x) * cell.half_width + std::fabs(z.y) * cell.half_height + rounding(z, cell.extent);
  const V zx = hn::Set(d, z.x), zy = hn::Set(d, z.y), z1 = hn::Set(d, z.one), zr = hn::Set(d, z_reach);
  const V zero = hn::Zero(d), max = hn::Set(d, 1 / kNearestDepth);
  const V min_depth = hn::Set(d, triangle.farthest), max_depth = hn::Set(d, triangle.nearest);
  const auto id = static_cast<std::uint32_t>(triangles_.size());
  const std::size_t found_before = found_count_;
  for (int row = first_row; row <= last_row; ++row) {
    for (int column = first_column / kColumns * kColumns; column <= last_column; column += kColumns) {
      const auto k = static_cast<std::size_t>(row * ImageCell::kWidth + column);
      const V x = hn::Load(d, &cell.x[k]), y = hn::Load(d, &cell.y[k]);
      const V depth = hn::MulAdd(zx, x, hn::MulAdd(zy, y, z1));
      const V farthest = hn::Max(hn::Sub(depth, zr), min_depth), nearest = hn::Min(hn::Add(depth, zr), max_depth);
      const V hidden = hn::Load(d, &hidden_below_[k]);
      auto visible = hn::And(hn::Ge(nearest, hidden), hn::And(hn::Gt(nearest, zero), hn::Lt(farthest, max)));
      auto fills = hn::And(hn::Gt(farthest, zero), hn::Lt(nearest, max));
      for (std::size_t e = 0; e < edge_count; ++e) {
        const Edge& edge = edges[e];
        const V weight = hn::MulAdd(hn::Set(d, edge.weight.x), x,
                                    hn::MulAdd(hn::Set(d, edge.weight.y), y, hn::Set(d, edge.weight.one)));
        const V reach = hn::Set(d, edge.reach);
        visible = hn::And(visible, hn::Gt(hn::Add(weight, reach), zero));
        fills = hn::And(fills, hn::Gt(weight, reach));
      }
      unsigned bits = bits_of(visible);
      const int skipped = std::max(0, first_column - column), kept = std::min(kColumns, last_column - column + 1);
      bits &= ((1U << kept) - 1) & ~((1U << skipped) - 1);
      if (bits == 0) continue;
      fills = hn::And(fills, visible);
      const unsigned fills_bits = bits_of(fills);
      // Only pixels that are wanted are read later.
      hn::Store(hn::IfThenElse(fills, hn::Max(hidden, farthest), hidden), d, &hidden_below_[k]);
      if (found_.size() < found_count_ + kColumns) found_.resize(2 * found_.size() + 1024);
      alignas(64) std::array<float, 8> nearest_values;
      hn::Store(nearest, d, nearest_values.data());
      for (; bits != 0; bits &= bits - 1) {
        const auto lane = static_cast<unsigned>(std::countr_zero(bits));
        found_[found_count_++] = {id, nearest_values[lane], static_cast<std::uint16_t>(k + lane),
                                  static_cast<std::uint16_t>(fills_bits >> lane & 1U)};
      }
    }
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
