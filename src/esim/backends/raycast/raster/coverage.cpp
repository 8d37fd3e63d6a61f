#include "esim/backends/raycast/raster/coverage.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "esim/backends/raycast/sample_places.h"

namespace esim::inline backends::inline raycast {
namespace {

constexpr float kMaxInverseDepth = 1 / kNearestDepth;
constexpr float kTouch = 1e-4F;         // px; what overlaps by less touches only
constexpr float kSameDepth = 2e-6F;     // relative; surfaces at the same depth: the first one is visible
constexpr std::size_t kMaxPieces = 24;  // of a fragment, or of what is left of a pixel
constexpr std::size_t kMaxCuts = 5;     // of a piece by a surface
constexpr float kFarCorner = 500;       // px; a corner farther away is not exact enough

using D = EightFloats;
constexpr std::size_t kVector = hn::MaxLanes(D());

Fragment fragment_of(std::uint32_t triangle, std::uint16_t pixel, const Moments& sum) {
  const float s = sum.s / sum.area, t = sum.t / sum.area;
  return {triangle,
          pixel,
          {s, t},
          {sum.ss / sum.area - s * s, sum.st / sum.area - s * t, sum.tt / sum.area - t * t},
          sum.area};
}

}  // namespace

PixelSamples::PixelSamples(int samples_per_pixel) {
  const std::vector<Eigen::Vector2f> places = sample_places(samples_per_pixel);
  count = places.size(), all = ~std::uint64_t{0} >> (kMax - count);
  for (std::size_t i = 0; i < count; ++i) s[i] = places[i].x(), t[i] = places[i].y();
}

SeenInMiddle Coverage::divide(const CellSurfaces& surfaces, const ImageCell& cell, int pixel,
                              std::vector<Fragment>& fragments) {
  const std::span<const Candidate> found = surfaces.at(pixel);
  if (found.empty()) return {};
  const auto k = static_cast<std::size_t>(pixel);
  if (found.size() == 1 && found[0].fills_pixel != 0) {
    const ScreenTriangle& triangle = surfaces.triangle(found[0].triangle);
    fragments.push_back({found[0].triangle, static_cast<std::uint16_t>(pixel), {0, 0}, {}, 1, samples_.shadows.all});
    return {triangle.inverse_depth().at(cell.x[k], cell.y[k]), triangle.group, found[0].triangle};
  }
  surfaces_ = &surfaces, cell_ = &cell, pixel_ = static_cast<std::uint16_t>(pixel), found_ = found;
  put_in_order();
  const std::size_t before = fragments.size();
  if (dense_.count == 1 || order_.size() > kMaxExact || !divide_exactly(fragments)) {
    fragments.resize(before);
    divide_by_samples(fragments);
  }
  if (for_shadows_) store_samples(std::span(fragments).subspan(before));
  return look_at_middle();
}

/// The nearest one first.
void Coverage::put_in_order() {
  candidates_.clear();
  candidates_.reserve(found_.size());  // so that references to its elements remain valid
  order_.clear();
  for (std::size_t i = 0; i < found_.size(); ++i) {
    // Positive numbers have the order of their bits.
    order_.push_back(std::uint64_t{std::bit_cast<std::uint32_t>(found_[i].nearest)} << 32 | i);
  }
  std::ranges::sort(order_, std::greater());
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
  std::uint32_t index = ~0U;
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
  for (std::size_t i = 0; i < order_.size() && !left_.empty(); ++i) {
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

/// Finds which samples are in each candidate, and which of them see it. Candidates behind all samples are left out.
void Coverage::look_at(const PixelSamples& samples) {
  const D d;
  const auto zero = hn::Zero(d), max = hn::Set(d, kMaxInverseDepth);
  alignas(64) std::array<float, PixelSamples::kMax> depth;
  const std::size_t count = (samples.count + kVector - 1) / kVector * kVector;
  for (std::size_t i = 0; i < count; i += kVector) hn::Store(zero, d, &depth[i]);
  covered_.clear(), visible_at_.clear();
  float farthest_seen = 0;
  for (std::size_t c = 0; c < order_.size() && nearest(c) >= farthest_seen; ++c) {
    const Local& local = this->local(c);
    covered_.push_back(0), visible_at_.push_back(0);
    if (local.outside) continue;
    const auto of = [&](std::size_t k, auto s, auto t) {
      return hn::MulAdd(hn::Set(d, local.s[k]), s, hn::MulAdd(hn::Set(d, local.t[k]), t, hn::Set(d, local.middle[k])));
    };
    std::uint64_t covered = 0, nearer = 0, equal = 0;
    auto farthest = max;
    for (std::size_t i = 0; i < count; i += kVector) {
      const auto s = hn::Load(d, &samples.s[i]), t = hn::Load(d, &samples.t[i]);
      const auto z = of(3, s, t), before = hn::Load(d, &depth[i]);
      const auto weight = hn::Min(hn::Min(of(0, s, t), of(1, s, t)), of(2, s, t));
      const auto inside = hn::And(hn::Ge(weight, zero), hn::And(hn::Gt(z, zero), hn::Le(z, max)));
      const auto now = hn::IfThenElse(inside, hn::Max(z, before), before);
      hn::Store(now, d, &depth[i]);
      farthest = hn::Min(farthest, now);
      covered |= std::uint64_t{bits_of(inside)} << i;
      nearer |= std::uint64_t{bits_of(hn::Gt(z, before))} << i;
      equal |= std::uint64_t{bits_of(hn::Eq(z, before))} << i;
    }
    covered &= samples.all;
    std::uint64_t visible = covered & nearer;
    for (std::size_t other = 0; other < c; ++other) {
      if (local.index < candidates_[other].index) visible |= covered & equal & visible_at_[other];
      visible_at_[other] &= ~visible;
    }
    covered_[c] = covered, visible_at_[c] = visible;
    farthest_seen = hn::GetLane(hn::MinOfLanes(d, farthest));
  }
}

/// Makes fragments of what the samples see. A surface that they see wherever they meet it is measured exactly; the
/// others share what is left.
void Coverage::divide_by_samples(std::vector<Fragment>& fragments) {
  look_at(dense_);
  parts_.clear();
  std::uint64_t background = dense_.all, others = dense_.all;  // samples that see no surface, or no whole part
  int partial = 0;
  for (std::uint32_t c = 0; c < covered_.size(); ++c) {
    const std::uint64_t visible_at = visible_at_[c];
    if (visible_at == 0) continue;
    const bool whole = visible_at == covered_[c] && dense_.count > 1;
    parts_.push_back({c, visible_at, whole, {}});
    background &= ~visible_at;
    if (whole) others &= ~visible_at;
    if (!whole) ++partial;
  }
  clip_whole_parts(0);
  const bool is_outline = partial + (background != 0 ? 1 : 0) == 1;  // in front of one other surface
  if (is_outline && others != dense_.all) add_neighbours();
  Moments left = Moments::pixel();
  for (const Part& part : parts_) {
    if (part.whole) left -= part.moments;
  }
  const bool is_full = others == 0 || left.area < 0;
  for (const Part& part : parts_) {
    Moments sum = part.moments;
    if (part.whole) {
      if (is_full) sum.scale(1 / (1 - left.area));
    } else if (is_full) {
      continue;
    } else if (is_outline) {
      sum = left;
    } else {
      sum = moments_of_samples(part.visible_at);
      sum.scale(left.area * static_cast<float>(dense_.count) / static_cast<float>(std::popcount(others)));
    }
    if (sum.area > kSmallestArea) fragments.push_back(fragment_of(found(part.candidate).triangle, pixel_, sum));
  }
}

/// Adds the candidates between samples that continue a whole part beyond one of its sides. Without them, the outline of
/// a surface of small triangles would not be exact.
void Coverage::add_neighbours() {
  std::size_t kept = parts_.size();
  for (std::uint32_t c = 0; c < covered_.size(); ++c) {
    if (covered_[c] == 0 && !candidates_[c].outside) parts_.push_back({c, 0, true, {}});
  }
  clip_whole_parts(kept);
  const auto triangle = [&](const Part& part) -> const ScreenTriangle& {
    return surfaces_->triangle(found(part.candidate).triangle);
  };
  for (std::size_t kept_before = 0; kept_before != kept;) {
    kept_before = kept;
    for (std::size_t i = kept; i < parts_.size(); ++i) {
      const auto continues = [&](const Part& part) {
        return part.whole && triangle(part).is_neighbour(triangle(parts_[i]));
      };
      const bool is_visible =
          parts_[i].moments.area > kSmallestArea && std::ranges::any_of(std::span(parts_).first(kept), continues);
      if (is_visible) std::swap(parts_[i], parts_[kept++]);
    }
  }
  parts_.resize(kept);
}

/// Each sample stands for a square of its part of the pixel.
Moments Coverage::moments_of_samples(std::uint64_t samples) const {
  const float part = 1 / static_cast<float>(dense_.count);
  Moments sum;
  for (; samples != 0; samples &= samples - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(samples));
    sum.add(part, dense_.s[i], dense_.t[i]), sum.add_products(part, dense_.s[i], dense_.t[i]);
  }
  sum.ss += sum.area * part / 12, sum.tt += sum.area * part / 12;
  return sum;
}

/// Computes the moments of the whole parts, from the `first` part on.
void Coverage::clip_whole_parts(std::size_t first) {
  const std::size_t k = pixel_;
  const float x = cell_->x[k], y = cell_->y[k];
  const float per_det = 1 / (cell_->dx_du[k] * cell_->dy_dv[k] - cell_->dx_dv[k] * cell_->dy_du[k]);
  const float s_x = cell_->dy_dv[k] * per_det, s_y = -cell_->dx_dv[k] * per_det;
  const float t_x = -cell_->dy_du[k] * per_det, t_y = cell_->dx_du[k] * per_det;
  std::array<Part*, ClippedTriangles::kCount> lanes;
  std::size_t used = 0;
  const auto flush = [&] {
    clipped_.integrate();
    for (std::size_t lane = 0; lane < used; ++lane) lanes[lane]->moments = clipped_.moments(lane);
    used = 0;
  };
  for (Part& part : std::span(parts_).subspan(first)) {
    if (!part.whole) continue;
    const ScreenTriangle& triangle = surfaces_->triangle(found(part.candidate).triangle);
    float farthest = triangle.nearest <= kMaxInverseDepth ? 0 : std::numeric_limits<float>::infinity();
    for (std::size_t c = 0; c < 3; ++c) {
      const float dx = triangle.corner_x[c] - x, dy = triangle.corner_y[c] - y;
      const float s = s_x * dx + s_y * dy, t = t_x * dx + t_y * dy;
      clipped_.s[c][used] = s, clipped_.t[c][used] = t;
      farthest = std::max(farthest, std::max(std::fabs(s), std::fabs(t)));
    }
    if (!(farthest < kFarCorner)) {
      Convex piece = Convex::pixel();
      remaining_.clear();
      keep_covered(piece, local(part.candidate), remaining_);
      if (!piece.empty()) piece.integrate(part.moments);
      continue;
    }
    lanes[used] = &part;
    if (++used == ClippedTriangles::kCount) flush();
  }
  if (used > 0) flush();
}

/// Fragments between samples have none.
void Coverage::store_samples(std::span<Fragment> fragments) {
  look_at(samples_.shadows);
  for (Fragment& fragment : fragments) {
    for (std::size_t c = 0; c < covered_.size(); ++c)
      if (found(c).triangle == fragment.triangle) fragment.samples |= visible_at_[c];
  }
}

}  // namespace esim::inline backends::inline raycast
