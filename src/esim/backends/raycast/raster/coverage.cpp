#include "esim/backends/raycast/raster/coverage.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace esim::inline backends::inline raycast {
namespace {

constexpr float kMaxInverseDepth = 1 / kNearestDepth;
constexpr float kTouch = 1e-4F;         // px; what overlaps by less touches only
constexpr float kSameDepth = 2e-6F;     // relative; surfaces at the same depth: the first one is visible
constexpr std::size_t kMaxPieces = 24;  // of a fragment, or of what is left of a pixel
constexpr std::size_t kMaxCuts = 5;     // of a piece by a surface

Fragment fragment_of(std::uint32_t triangle, std::uint16_t pixel, const Moments& sum) {
  const float s = sum.s / sum.area, t = sum.t / sum.area;
  return {triangle,
          pixel,
          {s, t},
          {sum.ss / sum.area - s * s, sum.st / sum.area - s * t, sum.tt / sum.area - t * t},
          sum.area};
}

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
    fragments.push_back({found[0].triangle, static_cast<std::uint16_t>(pixel), {0, 0}, {}, 1, every_sample_});
    return {triangle.inverse_depth().at(cell.x[k], cell.y[k]), triangle.group, found[0].triangle};
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
    Local& local = candidates_.emplace_back();
    const hn::FixedTag<float, 4> d;
    const auto x = hn::Load(d, triangle.x.data()), y = hn::Load(d, triangle.y.data());
    const auto along = [&](float dx, float dy) { return hn::MulAdd(x, hn::Set(d, dx), hn::Mul(y, hn::Set(d, dy))); };
    const auto middle = hn::Add(along(cell_->x[k], cell_->y[k]), hn::Load(d, triangle.one.data()));
    const auto s = along(cell_->dx_du[k], cell_->dy_du[k]), t = along(cell_->dx_dv[k], cell_->dy_dv[k]);
    const auto reach = hn::Mul(hn::Set(d, 0.5F), hn::Add(hn::Abs(s), hn::Abs(t)));
    hn::Store(middle, d, local.middle.data()), hn::Store(s, d, local.s.data());
    hn::Store(t, d, local.t.data()), hn::Store(reach, d, local.reach.data());
    local.nearest = std::min(local.middle[3] + local.reach[3], triangle.nearest);
    local.farthest = std::max(local.middle[3] - local.reach[3], triangle.farthest);
    local.triangle = found(i).triangle, local.group = triangle.group, local.index = triangle.index;
    constexpr unsigned kEdges = 7;  // without the inverse depth
    std::array<std::uint8_t, 8> crossing{}, outside{};
    hn::StoreMaskBits(d, hn::Lt(middle, reach), crossing.data());
    hn::StoreMaskBits(d, hn::Lt(middle, hn::Neg(reach)), outside.data());
    local.crossing = crossing[0] & kEdges, local.outside = (outside[0] & kEdges) != 0;
  }
  return candidates_[candidate];
}

SeenInMiddle Coverage::look_at_middle() {
  SeenInMiddle seen;
  std::uint32_t index = kNone;
  for (std::size_t i = 0; i < order_.size() && nearest(i) >= seen.inverse_depth; ++i) {
    const Local& local = this->local(i);
    const float z = local.middle[3];
    const bool inside = local.middle[0] >= 0 && local.middle[1] >= 0 && local.middle[2] >= 0;
    if (!inside || !(z > 0) || !(z <= kMaxInverseDepth)) continue;
    if (z > seen.inverse_depth || (z == seen.inverse_depth && local.index < index))
      seen = {z, local.group, local.triangle}, index = local.index;
  }
  return seen;
}

/// Divides the pixel from front to back: each surface takes its part of what those before it have left. False if that
/// takes too many polygons.
bool Coverage::divide_exactly(std::vector<Fragment>& fragments) {
  left_.assign(1, Convex::pixel());
  candidates_.reserve(order_.size());  // so that references to its elements remain valid
  for (std::size_t i = 0; i < order_.size() && !left_.empty(); ++i) {
    if (i == kMaxExact) return false;
    Moments sum;
    if (i + 1 == order_.size() && found(i).fills_pixel != 0) {
      for (const Convex& piece : left_) piece.integrate(sum);
      left_.clear();
    } else if (!local(i).outside) {
      remaining_.clear();
      for (Convex& piece : left_) {
        if (!take(piece, i)) return false;
        for (const Convex& visible : visible_) visible.integrate(sum);
      }
      std::swap(left_, remaining_);
    }
    if (sum.area > kSmallestArea) fragments.push_back(fragment_of(found(i).triangle, pixel_, sum));
  }
  return true;
}

/// Makes visible_ the part of a piece that a surface covers and no other one hides; adds all others to remaining_.
/// False if that takes too many polygons.
bool Coverage::take(Convex& piece, std::size_t candidate) {
  const Local& surface = local(candidate);
  visible_.clear();
  if (is_apart(piece, surface)) {
    remaining_.push_back(piece);
    return true;
  }
  if (!keep_covered(piece, surface, remaining_)) return false;
  if (piece.empty()) return true;
  visible_.push_back(piece);
  // Surfaces are in the order of their nearest points, so that one after this may be in front of it elsewhere.
  for (std::size_t i = candidate + 1; i < order_.size() && nearest(i) >= surface.farthest; ++i) {
    if (i == kMaxExact) return false;
    const Local& other = local(i);
    if (!other.outside && other.nearest >= surface.farthest && !hide(surface, other)) return false;
  }
  return remaining_.size() <= kMaxPieces;
}

/// Whether a piece is outside a surface, or touches it only.
bool Coverage::is_apart(const Convex& piece, const Local& surface) {
  if (piece.empty()) return true;
  // Only an edge with a corner outside it may have all of them there.
  const hn::FixedTag<float, 4> d;
  const PixelPoint corner = piece.first();
  const auto at =
      hn::MulAdd(hn::Load(d, surface.s.data()), hn::Set(d, corner.s),
                 hn::MulAdd(hn::Load(d, surface.t.data()), hn::Set(d, corner.t), hn::Load(d, surface.middle.data())));
  const auto touch = hn::Mul(hn::Load(d, surface.reach.data()), hn::Set(d, 2 * kTouch));
  std::array<std::uint8_t, 8> bits{};
  hn::StoreMaskBits(d, hn::Le(at, touch), bits.data());
  for (unsigned left = bits[0] & surface.crossing; left != 0; left &= left - 1) {
    const auto e = static_cast<std::size_t>(std::countr_zero(left));
    if (piece.is_below(surface.function(e), 2 * kTouch * surface.reach[e])) return true;
  }
  return false;
}

/// Cuts a piece down to what a surface covers; adds the others to `rests`. False if it has too many corners.
bool Coverage::keep_covered(Convex& piece, const Local& surface, std::vector<Convex>& rests) {
  if (!piece.can_be_cut(kMaxCuts)) return false;
  Convex rest;
  const auto cut = [&](const OfPixel& f, float reach) {
    piece.cut(f, rest, 2 * kTouch * reach);
    if (!rest.empty()) rests.push_back(rest);
  };
  for (unsigned left = surface.crossing; left != 0; left &= left - 1) {
    const auto e = static_cast<std::size_t>(std::countr_zero(left));
    cut(surface.function(e), surface.reach[e]);
  }
  if (surface.nearest > kMaxInverseDepth) {
    const OfPixel z = surface.inverse_depth();
    cut({kMaxInverseDepth - z.middle, -z.s, -z.t}, surface.reach[3]);
  }
  return true;
}

/// Moves the parts of visible_ that another surface hides to remaining_. False if too many polygons remain.
bool Coverage::hide(const Local& surface, const Local& other) {
  const OfPixel z = surface.inverse_depth(), other_z = other.inverse_depth();
  const OfPixel nearer{other_z.middle - z.middle, other_z.s - z.s, other_z.t - z.t};
  const float same = kSameDepth * std::max(surface.nearest, other.nearest);
  const std::size_t count = visible_.size();
  for (std::size_t i = 0; i < count; ++i) {
    Convex piece = visible_[i];
    if (is_apart(piece, other)) continue;
    const bool same_depth = piece.is_near_zero(nearer, same);
    if (same_depth ? surface.index < other.index : piece.is_below(nearer, same)) continue;
    visible_[i] = {};
    if (!keep_covered(piece, other, visible_)) return false;
    if (!same_depth) {
      Convex rest;
      piece.cut(nearer, rest, same);
      if (!rest.empty()) visible_.push_back(rest);
    }
    if (!piece.empty()) remaining_.push_back(piece);
  }
  return visible_.size() <= kMaxPieces;
}

/// Finds what each sample sees.
void Coverage::look_at_samples() {
  const std::size_t count = samples_.size();
  alignas(64) std::array<float, kMaxSamples> depth;
  alignas(64) std::array<std::uint32_t, kMaxSamples> index;
  for (std::size_t i = 0; i < count; ++i) depth[i] = 0, index[i] = kNone, seen_[i] = kNone;
  for (std::size_t c = 0; c < order_.size(); ++c) {
    const Local& local = this->local(c);
    const OfPixel w0 = local.function(0), w1 = local.function(1), w2 = local.function(2);
    const OfPixel z = local.inverse_depth();
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
  // Each sample stands for a square of its part of the pixel.
  const std::size_t count = samples_.size();
  const float part = 1 / static_cast<float>(count);
  std::vector<Moments> sums(candidates_.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (seen_[i] == kNone) continue;
    Moments& sum = sums[seen_[i]];
    sum.add(part, s_[i], t_[i]), sum.add_products(part, s_[i], t_[i]);
    sum.ss += part * part / 12, sum.tt += part * part / 12;
  }
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    if (sums[c].area > 0) fragments.push_back(fragment_of(candidates_[c].triangle, pixel_, sums[c]));
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
