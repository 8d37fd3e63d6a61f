#include "esim/backends/raycast/raster/coverage.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace esim::inline backends::inline raycast {
namespace {

constexpr float kMaxInverseDepth = 1 / kNearestDepth;
constexpr float kTouch = 1e-4F;         // px; triangles that overlap by less touch each other
constexpr float kSameDepth = 2e-6F;     // relative; surfaces at the same depth: the first one is visible
constexpr std::size_t kMaxPieces = 24;  // of a fragment

}  // namespace

Coverage::Coverage(std::span<const Eigen::Vector2f> places, bool store_samples)
    : store_samples_(store_samples), every_sample_(~std::uint64_t{0} >> (64 - places.size())) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    samples_.push_back({places[i].x(), places[i].y()});
    s_[i] = samples_[i].s, t_[i] = samples_[i].t;
  }
}

SeenInMiddle Coverage::divide(const CellSurfaces& surfaces, const ImageCell& cell, int pixel,
                              std::vector<Fragment>& fragments) {
  const std::span<const Candidate> found = surfaces.at(pixel);
  if (found.empty()) return {};
  const auto k = static_cast<std::size_t>(pixel);
  if (found.size() == 1 && found[0].fills_pixel != 0) {
    const ScreenTriangle& triangle = surfaces.triangle(found[0].triangle);
    fragments.push_back({found[0].triangle, static_cast<std::uint16_t>(pixel), {0, 0}, 1, every_sample_});
    return {triangle.inverse_depth.at(cell.x[k], cell.y[k]), triangle.group};
  }
  surfaces_ = &surfaces, cell_ = &cell, pixel_ = static_cast<std::uint16_t>(pixel);
  candidates_.clear();
  found_ = found;
  order_.clear();
  for (std::size_t i = 0; i < found.size(); ++i) {
    // Positive numbers have the order of their bits.
    const std::uint64_t key = std::uint64_t{std::bit_cast<std::uint32_t>(found[i].nearest)} << 32 | i;
    std::size_t at = order_.size();
    order_.push_back(key);
    for (; at > 0 && order_[at - 1] < key; --at) order_[at] = order_[at - 1];
    order_[at] = key;
  }
  const std::size_t before = fragments.size();
  const bool exact = samples_.size() > 1 && divide_exactly(fragments);
  if (!exact || store_samples_) look_at_samples();
  if (!exact) {
    fragments.resize(before);
    divide_by_samples(fragments);
  }
  if (store_samples_) store_samples(std::span(fragments).subspan(before));
  return look_at_middle();
}

float Coverage::nearest(std::size_t candidate) const {
  return std::bit_cast<float>(static_cast<std::uint32_t>(order_[candidate] >> 32));
}

/// The candidate of that place in the order. Only those that are needed are transformed.
const Coverage::Local& Coverage::local(std::size_t candidate) {
  for (std::size_t i = candidates_.size(); i <= candidate; ++i) {
    const ScreenTriangle& triangle = surfaces_->triangle(found(i).triangle);
    const std::size_t k = pixel_;
    const float x = cell_->x[k], y = cell_->y[k];
    const float dx_du = cell_->dx_du[k], dx_dv = cell_->dx_dv[k], dy_du = cell_->dy_du[k], dy_dv = cell_->dy_dv[k];
    const auto in_pixel = [&](const OfBearing& f) {
      return OfPixel{f.at(x, y), f.x * dx_du + f.y * dy_du, f.x * dx_dv + f.y * dy_dv};
    };
    Local& local = candidates_.emplace_back();
    local.inverse_depth = in_pixel(triangle.inverse_depth);
    const float depth_reach = local.inverse_depth.reach();
    local.nearest = std::min(local.inverse_depth.middle + depth_reach, triangle.nearest);
    local.farthest = std::max(local.inverse_depth.middle - depth_reach, triangle.farthest);
    local.edges = 0, local.outside = false;
    local.triangle = found(i).triangle, local.group = triangle.group, local.index = triangle.index;
    std::size_t end = 3;
    for (const OfBearing& weight : triangle.weight) {
      const OfPixel edge = in_pixel(weight);
      const float reach = edge.reach();
      local.outside = local.outside || edge.middle < -reach;
      local.weight[edge.middle < reach ? local.edges++ : --end] = edge;
    }
  }
  return candidates_[candidate];
}

SeenInMiddle Coverage::look_at_middle() {
  SeenInMiddle seen;
  std::uint32_t index = kNone;
  for (std::size_t i = 0; i < order_.size() && nearest(i) >= seen.inverse_depth; ++i) {
    const Local& local = this->local(i);
    const float z = local.inverse_depth.middle;
    const bool inside = local.weight[0].middle >= 0 && local.weight[1].middle >= 0 && local.weight[2].middle >= 0;
    if (!inside || !(z > 0) || !(z <= kMaxInverseDepth)) continue;
    if (z > seen.inverse_depth || (z == seen.inverse_depth && local.index < index))
      seen = {z, local.group}, index = local.index;
  }
  return seen;
}

/// The visible parts of triangles are a partition of the pixel, so that none is left to see when their areas add up to
/// 1. False if that takes too many polygons.
bool Coverage::divide_exactly(std::vector<Fragment>& fragments) {
  float sum = 0, sum_s = 0, sum_t = 0;
  for (std::size_t i = 0; i < order_.size() && sum < 1 - kSmallestArea; ++i) {
    if (i == kMaxExact) return false;
    float area = 0, s = 0, t = 0;
    if (i + 1 == order_.size() && found(i).fills_pixel != 0) {
      area = 1 - sum, s = -sum_s, t = -sum_t;  // behind the others
    } else {
      if (local(i).outside) continue;
      if (!keep_visible(i)) return false;
      for (const Convex& piece : pieces_) piece.integrate(area, s, t);
    }
    if (!(area > kSmallestArea)) continue;
    fragments.push_back({found(i).triangle, pixel_, {s / area, t / area}, area});
    sum += area, sum_s += s, sum_t += t;
  }
  return true;
}

/// Makes pieces_ the visible part of a surface. False if that takes too many polygons.
bool Coverage::keep_visible(std::size_t self) {
  const Local surface = local(self);  // a copy, since the list grows
  pieces_.assign(1, Convex::pixel());
  Convex &whole = pieces_[0], rest;
  for (std::size_t e = 0; e < surface.edges; ++e) whole.cut(surface.weight[e], rest);
  const OfPixel& z = surface.inverse_depth;
  if (surface.nearest > kMaxInverseDepth) whole.cut({kMaxInverseDepth - z.middle, -z.s, -z.t}, rest);
  if (whole.empty()) pieces_.clear();
  const float farthest = surface.farthest;
  for (std::size_t i = 0; i < order_.size() && nearest(i) >= farthest && !pieces_.empty(); ++i) {
    if (i == self) continue;
    if (i == kMaxExact) return false;
    const Local& other = local(i);
    if (!other.outside && other.nearest >= farthest && !hide(surface, other)) return false;
  }
  return true;
}

/// Removes from the pieces of a surface what another one hides. False if too many remain.
bool Coverage::hide(const Local& surface, const Local& other) {
  const OfPixel &z = surface.inverse_depth, &other_z = other.inverse_depth;
  const OfPixel nearer{other_z.middle - z.middle, other_z.s - z.s, other_z.t - z.t};
  const bool surely_nearer = other.farthest > surface.nearest;
  bool same_depth = false;
  const auto is_apart = [&](const Convex& piece) {
    for (std::size_t e = 0; e < other.edges; ++e) {
      if (piece.is_below(other.weight[e], kTouch * 2 * other.weight[e].reach())) return true;
    }
    if (surely_nearer) return false;
    same_depth = piece.is_near_zero(nearer, kSameDepth * std::max(surface.nearest, other.nearest));
    return same_depth ? surface.index < other.index : piece.is_below(nearer, 0);
  };
  if (pieces_.size() == 1 && is_apart(pieces_[0])) return true;
  kept_.clear();
  for (Convex& piece : pieces_) {
    if (is_apart(piece)) {
      kept_.push_back(piece);
      continue;
    }
    constexpr std::size_t kMaxCuts = 5;
    if (!piece.can_be_cut(kMaxCuts)) return false;
    Convex rest;
    const auto cut = [&](const OfPixel& f) {
      piece.cut(f, rest);
      if (!rest.empty()) kept_.push_back(rest);
    };
    for (std::size_t e = 0; e < other.edges; ++e) cut(other.weight[e]);
    if (other.nearest > kMaxInverseDepth) cut({kMaxInverseDepth - other_z.middle, -other_z.s, -other_z.t});
    if (!surely_nearer && !same_depth) cut(nearer);
    if (kept_.size() > kMaxPieces) return false;
  }
  std::swap(pieces_, kept_);
  return true;
}

/// Finds what each sample sees.
void Coverage::look_at_samples() {
  const std::size_t count = samples_.size();
  alignas(64) std::array<float, kMaxSamples> depth;
  alignas(64) std::array<std::uint32_t, kMaxSamples> index;
  for (std::size_t i = 0; i < count; ++i) depth[i] = 0, index[i] = kNone, seen_[i] = kNone;
  for (std::size_t c = 0; c < order_.size(); ++c) {
    const Local& local = this->local(c);
    const OfPixel w0 = local.weight[0], w1 = local.weight[1], w2 = local.weight[2];
    const OfPixel z = local.inverse_depth;
    const std::uint32_t local_index = local.index, id = static_cast<std::uint32_t>(c);
#pragma omp simd
    for (std::size_t i = 0; i < count; ++i) {
      const float s = s_[i], t = t_[i];
      const float a = w0.middle + w0.s * s + w0.t * t, b = w1.middle + w1.s * s + w1.t * t;
      const float e = w2.middle + w2.s * s + w2.t * t, at = z.middle + z.s * s + z.t * t;
      const bool inside = (a >= 0) & (b >= 0) & (e >= 0) & (at > 0) & (at <= kMaxInverseDepth);
      const bool nearer = inside & ((at > depth[i]) | ((at == depth[i]) & (local_index < index[i])));
      depth[i] = nearer ? at : depth[i];
      index[i] = nearer ? local_index : index[i];
      seen_[i] = nearer ? id : seen_[i];
    }
  }
}

void Coverage::divide_by_samples(std::vector<Fragment>& fragments) {
  struct Sum {
    float count = 0, s = 0, t = 0;
  };
  const std::size_t count = samples_.size();
  std::vector<Sum> sums(candidates_.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (seen_[i] == kNone) continue;
    Sum& sum = sums[seen_[i]];
    sum.count += 1, sum.s += s_[i], sum.t += t_[i];
  }
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    const Sum& sum = sums[c];
    if (sum.count == 0) continue;
    const PixelPoint centroid{sum.s / sum.count, sum.t / sum.count};
    fragments.push_back({candidates_[c].triangle, pixel_, centroid, sum.count / static_cast<float>(count)});
  }
}

/// Fragments between samples have none.
void Coverage::store_samples(std::span<Fragment> fragments) {
  for (Fragment& fragment : fragments) {
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (seen_[i] != kNone && candidates_[seen_[i]].triangle == fragment.triangle)
        fragment.samples |= std::uint64_t{1} << i;
    }
  }
}

}  // namespace esim::inline backends::inline raycast
