#include "esim/backends/raycast/raster/coverage.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "esim/backends/raycast/sample_places.h"

namespace esim::inline backends::inline raycast {
namespace {

constexpr float kTouch = 1e-4F;         // px; what overlaps by less touches only
constexpr float kSameDepth = 2e-6F;     // relative; surfaces at the same depth: the first one is visible
constexpr std::size_t kMaxPieces = 24;  // of a fragment, or of what is left of a pixel
constexpr std::size_t kMaxCuts = 5;     // of a piece by a surface

using D = EightFloats;
constexpr std::size_t kVector = hn::MaxLanes(D());

}  // namespace

PixelSamples::PixelSamples(int samples_per_pixel) {
  std::vector<Eigen::Vector2f> places = sample_places(samples_per_pixel);
  count = places.size(), all = ~std::uint64_t{0} >> (kMax - count);
  // Rows of four blocks
  constexpr std::size_t kRow = 4 * kBlock;
  const auto by = [&](std::size_t begin, std::size_t end, Eigen::Index axis) {
    std::ranges::sort(std::span(places).subspan(begin, std::min(end, count) - begin), {},
                      [axis](const Eigen::Vector2f& place) { return std::pair(place[axis], place[1 - axis]); });
  };
  by(0, count, 1);
  for (std::size_t row = 0; row < count; row += kRow) by(row, row + kRow, 0);
  for (std::size_t i = 0; i < count; ++i) s[i] = places[i].x(), t[i] = places[i].y();
  for (std::size_t block = 0; block * kBlock < count; ++block) {
    const auto extent = [&](const std::array<float, kMax>& of, float& middle, float& half) {
      const auto [low, high] = std::ranges::minmax(
          std::span(of).first(count).subspan(block * kBlock).first(std::min(kBlock, count - block * kBlock)));
      middle = 0.5F * (low + high), half = 0.5F * (high - low);
    };
    extent(s, block_s[block], half_s[block]), extent(t, block_t[block], half_t[block]);
  }
}

SeenInMiddle Coverage::divide(int pixel, std::vector<Fragment>& fragments) {
  pixel_ = static_cast<std::uint16_t>(pixel), found_ = surfaces_->at(pixel);
  if (found_.empty()) return {};
  if (found_.size() == 1 && found_[0].fills_pixel != 0) {
    const ScreenTriangle& triangle = surfaces_->triangle(found_[0].triangle);
    fragments.emplace_back(found_[0].triangle, pixel_).samples = samples_.shadows.all;
    return {triangle.inverse_depth().at(cell_->x[pixel_], cell_->y[pixel_]), triangle.group, found_[0].triangle};
  }
  candidates_.take(*surfaces_, *cell_, pixel_, found_);
  const SeenInMiddle seen = look_at_middle();
  if (dense_.count == 1) {
    if (seen.inverse_depth > 0) fragments.emplace_back(seen.triangle, pixel_).samples = samples_.shadows.all;
    return seen;
  }
  // The light on a surface may have edges, which need all of its triangles.
  if (!for_shadows_ && sheets_.divide(pixel_, candidates_.all(), fragments)) return seen;
  put_in_order();
  const std::size_t before = fragments.size();
  if (order_.size() > kMaxExact || !divide_exactly(fragments)) {
    fragments.resize(before);
    divide_by_samples(fragments);
  }
  if (for_shadows_) {
    store_samples(std::span(fragments).subspan(before));
  } else {
    sheets_.join(fragments, before);
  }
  return seen;
}

/// The nearest one first.
void Coverage::put_in_order() {
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

SeenInMiddle Coverage::look_at_middle() const {
  SeenInMiddle seen;
  std::uint32_t index = ~0U;
  for (const PixelTriangle& candidate : candidates_.all()) {
    const float z = candidate.middle[3];
    if (!candidate.in_middle || !(z > 0) || !(z <= kMaxInverseDepth)) continue;
    if (z > seen.inverse_depth || (z == seen.inverse_depth && candidate.index < index))
      seen = {z, candidate.group, candidate.triangle}, index = candidate.index;
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
    if (sum.area > kSmallestArea) fragments.push_back(Fragment(found(i).triangle, pixel_, sum));
  }
  return true;
}

/// Makes visible_ the part of a piece that a surface covers and no other one hides; adds all others to remaining_.
/// False if that takes too many polygons.
bool Coverage::take(Convex& piece, std::size_t candidate) {
  const PixelTriangle& surface = local(candidate);
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
    const PixelTriangle& other = local(i);
    if (!other.outside && other.nearest >= surface.farthest && !hide(surface, other)) return false;
  }
  return remaining_.size() <= kMaxPieces;
}

/// Whether a piece is outside a surface, or touches it only.
bool Coverage::is_apart(const Convex& piece, const PixelTriangle& surface) {
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
bool Coverage::keep_covered(Convex& piece, const PixelTriangle& surface, std::vector<Convex>& rests) {
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
bool Coverage::hide(const PixelTriangle& surface, const PixelTriangle& other) {
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
  const hn::RebindToSigned<D> di;
  const auto zero = hn::Zero(d), max = hn::Set(d, kMaxInverseDepth);
  alignas(64) std::array<float, PixelSamples::kMax> depth;
  alignas(64) std::array<std::int32_t, PixelSamples::kMax> seen;  // candidate
  const std::size_t blocks = (samples.count + PixelSamples::kBlock - 1) / PixelSamples::kBlock;
  depth.fill(0), seen.fill(-1);
  covered_.clear();
  float farthest_seen = 0;
  for (std::size_t c = 0; c < order_.size() && nearest(c) >= farthest_seen; ++c) {
    const PixelTriangle& triangle = local(c);
    covered_.push_back(0);
    if (triangle.outside) continue;
    const auto of = [&](std::size_t k, auto s, auto t) {
      const auto along = hn::MulAdd(hn::Set(d, triangle.t[k]), t, hn::Set(d, triangle.middle[k]));
      return hn::MulAdd(hn::Set(d, triangle.s[k]), s, along);
    };
    unsigned met = 0;  // a bit for each block that may have samples in the triangle
    for (std::size_t i = 0; i < blocks; i += kVector) {
      const auto load = [&](const auto& values) { return hn::Load(d, &values[i]); };
      const auto reach = [&](std::size_t k) {  // slightly more than the function can be
        const auto size = [&](float by) { return hn::Set(d, 1.001F * std::fabs(by)); };
        const auto half =
            hn::MulAdd(size(triangle.s[k]), load(samples.half_s), hn::Mul(size(triangle.t[k]), load(samples.half_t)));
        return hn::Add(of(k, load(samples.block_s), load(samples.block_t)), half);
      };
      met |= bits_of(hn::Ge(hn::Min(hn::Min(reach(0), reach(1)), reach(2)), zero)) << i;
    }
    std::uint64_t covered = 0, equal = 0;
    const auto candidate = hn::Set(di, static_cast<std::int32_t>(c));
    for (unsigned left = met & ((1U << blocks) - 1); left != 0; left &= left - 1) {
      const std::size_t first = static_cast<std::size_t>(std::countr_zero(left)) * PixelSamples::kBlock;
      for (std::size_t i = first; i < first + PixelSamples::kBlock; i += kVector) {
        const auto s = hn::Load(d, &samples.s[i]), t = hn::Load(d, &samples.t[i]);
        const auto z = of(3, s, t), before = hn::Load(d, &depth[i]);
        const auto weight = hn::Min(hn::Min(of(0, s, t), of(1, s, t)), of(2, s, t));
        const auto inside = hn::And(hn::Ge(weight, zero), hn::And(hn::Gt(z, zero), hn::Le(z, max)));
        const auto nearer = hn::And(inside, hn::Gt(z, before));
        hn::Store(hn::IfThenElse(nearer, z, before), d, &depth[i]);
        hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), candidate, hn::Load(di, &seen[i])), di, &seen[i]);
        covered |= std::uint64_t{bits_of(inside)} << i;
        equal |= std::uint64_t{bits_of(hn::And(inside, hn::Eq(z, before)))} << i;
      }
    }
    covered_[c] = covered & samples.all;
    for (equal &= samples.all; equal != 0; equal &= equal - 1) {
      std::int32_t& other = seen[static_cast<std::size_t>(std::countr_zero(equal))];
      if (triangle.index < local(static_cast<std::size_t>(other)).index) other = static_cast<std::int32_t>(c);
    }
    if (covered == 0) continue;
    auto farthest = max;
    for (std::size_t i = 0; i < blocks * PixelSamples::kBlock; i += kVector)
      farthest = hn::Min(farthest, hn::Load(d, &depth[i]));
    farthest_seen = hn::GetLane(hn::MinOfLanes(d, farthest));
  }
  visible_at_.assign(covered_.size(), 0);
  for (std::size_t i = 0; i < samples.count; ++i) {
    if (seen[i] >= 0) visible_at_[static_cast<std::size_t>(seen[i])] |= std::uint64_t{1} << i;
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
    const bool whole = visible_at == covered_[c];
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
    if (sum.area > kSmallestArea) fragments.push_back(Fragment(found(part.candidate).triangle, pixel_, sum));
  }
}

/// Adds the candidates between samples that continue a whole part beyond one of its sides. Without them, the outline of
/// a surface of small triangles would not be exact.
void Coverage::add_neighbours() {
  std::size_t kept = parts_.size();
  for (std::uint32_t c = 0; c < covered_.size(); ++c) {
    if (covered_[c] == 0 && !local(c).outside) parts_.push_back({c, 0, true, {}});
  }
  clip_whole_parts(kept);
  for (std::size_t next = 0; next < kept; ++next) {
    if (!parts_[next].whole) continue;
    for (std::size_t i = kept; i < parts_.size(); ++i) {
      if (parts_[i].moments.area <= kSmallestArea) continue;
      if (sheets_.continues(local(parts_[next].candidate).triangle, local(parts_[i].candidate).triangle))
        std::swap(parts_[i], parts_[kept++]);
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
  const PixelFrame frame(*cell_, pixel_);
  std::array<Part*, ClippedTriangles::kCount> lanes;
  std::size_t used = 0;
  const auto flush = [&] {
    clipped_.integrate();
    for (std::size_t lane = 0; lane < used; ++lane) lanes[lane]->moments = clipped_.moments(lane);
    used = 0;
  };
  for (Part& part : std::span(parts_).subspan(first)) {
    if (!part.whole) continue;
    if (!clipped_.set(used, surfaces_->triangle(found(part.candidate).triangle), frame)) {
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
