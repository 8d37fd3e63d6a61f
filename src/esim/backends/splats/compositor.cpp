#include "esim/backends/splats/compositor.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "esim/scene/splats/splat_rules.h"

namespace esim::inline backends::inline splats {
namespace {

HWY_INLINE Lanes load(const std::array<float, static_cast<std::size_t>(kLanes)>& row) {
  return hn::Load(kTag, row.data());
}
HWY_INLINE void store(Lanes value, std::array<float, static_cast<std::size_t>(kLanes)>& row) {
  hn::Store(value, kTag, row.data());
}

/// Positions of the lanes in a block.
struct LanePlaces {
  alignas(32) std::array<float, static_cast<std::size_t>(kLanes)> x, y;
};
constexpr LanePlaces kPlaces = [] {
  LanePlaces places{};
  for (int lane = 0; lane < kLanes; ++lane) {
    places.x[static_cast<std::size_t>(lane)] = static_cast<float>(lane % kBlockWidth);
    places.y[static_cast<std::size_t>(lane)] = static_cast<float>(lane / kBlockWidth);
  }
  return places;
}();

/// The inverse depth of a splat, 1/m, at a place relative to its centre.
HWY_INLINE Lanes nearness_at(const ScreenSplat& splat, Lanes dx, Lanes dy) {
  const Lanes linear = hn::MulAdd(all(splat.right), dx, hn::MulAdd(all(splat.down), dy, all(splat.nearness)));
  return hn::Min(hn::Max(linear, all(splat.farthest)), all(splat.nearest));
}

/// What is added to the inverse depth of a splat in the order `ray`, 1/m: splats in a plane are equally deep on every
/// ray, up to rounding, and then follow each other by distance.
float tie_break(const ScreenSplat& splat) { return kTieBreak / splat.distance; }

}  // namespace

void Compositor::start(int left, int top) {
  left_ = left, top_ = top;
  splats_.clear();
  finished_ = 0;
  surfaces_ = false;
  for (Block& block : blocks_) {
    for (Row* row : {&block.red, &block.green, &block.blue, &block.nearness, &block.object, &block.surface})
      row->fill(0);
    block.transmittance.fill(1);
    block.finished = false;
  }
}

void Compositor::set_surface(int column, int row, float nearness) {
  blocks_[block_of(column, row)].surface[lane_of(column, row)] = nearness;
  surfaces_ = true;
}

Compositor::Pixel Compositor::pixel(int column, int row) const {
  const Block& block = blocks_[block_of(column, row)];
  const std::size_t lane = lane_of(column, row);
  return {{block.red[lane], block.green[lane], block.blue[lane]},
          block.transmittance[lane],
          block.nearness[lane],
          block.object[lane]};
}

void Compositor::add(const ScreenSplat& splat, int left, int right, int top, int bottom) {
  const auto column = [&](int x) {
    return static_cast<std::uint8_t>(std::clamp(x - left_, 0, kSide - 1) / kBlockWidth);
  };
  const auto row = [&](int y) { return static_cast<std::uint8_t>(std::clamp(y - top_, 0, kSide - 1) / kBlockHeight); };
  splats_.push_back(
      {std::bit_cast<std::uint32_t>(order_of(splat)), column(left), column(right), row(top), row(bottom), &splat});
}

/// Smaller for splats in front, and positive.
float Compositor::order_of(const ScreenSplat& splat) const {
  if (order_ == SplatOrder::distance) return splat.distance;
  if (order_ == SplatOrder::depth) return 1 / splat.nearness;
  constexpr float kMiddle = 0.5F * (kSide - 1);
  const float linear = splat.nearness + splat.right * (static_cast<float>(left_) + kMiddle - splat.x) +
                       splat.down * (static_cast<float>(top_) + kMiddle - splat.y);
  const float limited =
      linear > splat.farthest ? std::min(linear, splat.nearest) : splat.farthest;  // not a number, too
  return 1 / (limited + tie_break(splat));
}

/// Sorts the splats from front to back, and equal ones in the order in which they were added: a radix sort of bytes.
void Compositor::sort() {
  std::uint32_t some = 0, every = ~0U;
  for (const Listed& listed : splats_) some |= listed.order, every &= listed.order;
  sorted_.resize(splats_.size());
  for (int shift = 0; shift < 32; shift += 8) {
    if (((some ^ every) >> shift & 255) == 0) continue;  // equal in all splats
    std::array<std::uint32_t, 257> begins{};
    for (const Listed& listed : splats_) ++begins[(listed.order >> shift & 255) + 1];
    for (std::size_t i = 1; i < begins.size(); ++i) begins[i] += begins[i - 1];
    for (const Listed& listed : splats_) sorted_[begins[listed.order >> shift & 255]++] = listed;
    splats_.swap(sorted_);
  }
}

void Compositor::blend() {
  sort();
  if (order_ == SplatOrder::ray) return grey_ ? blend_by_ray<true>() : blend_by_ray<false>();
  grey_ ? blend_all<true>() : blend_all<false>();
}

/// Calls body(block, its number, x, y) for the unfinished blocks that a splat may reach; (x, y): from the splat's
/// centre to the block's first pixel.
template <class Body>
void Compositor::for_each_block(const Listed& listed, const Body& body) {
  for (int row = listed.first_row; row <= listed.last_row; ++row) {
    for (int column = listed.first_column; column <= listed.last_column; ++column) {
      const auto number = static_cast<std::size_t>(row * kColumns + column);
      Block& block = blocks_[number];
      if (block.finished) continue;
      body(block, number, static_cast<float>(left_ + column * kBlockWidth) - listed.splat->x,
           static_cast<float>(top_ + row * kBlockHeight) - listed.splat->y);
    }
  }
}

/// The opacity of a splat in a block; `any`: in one of the pixels that are not finished.
HWY_INLINE Compositor::Overlap Compositor::overlap(const ScreenSplat& splat, float x, float y,
                                                   const Block& block) const {
  Overlap found;
  const Lanes dx = hn::Add(all(x), load(kPlaces.x)), dy = hn::Add(all(y), load(kPlaces.y));
  const Lanes exponent = hn::MulAdd(dx, hn::MulAdd(all(splat.xx), dx, hn::Mul(all(splat.xy), dy)),
                                    hn::MulAdd(hn::Mul(all(splat.yy), dy), dy, all(splat.peak)));
  constexpr float kLeast = -8.9943534F;  // log2(kInvisible)
  auto reached = hn::And(hn::Gt(exponent, all(kLeast)), hn::Gt(load(block.transmittance), all(kFinished)));
  found.any = !hn::AllFalse(kTag, reached);
  if (!found.any) return found;

  found.dx = dx, found.dy = dy;
  if (surfaces_) reached = hn::And(reached, hn::Gt(nearness_at(splat, dx, dy), load(block.surface)));
  const Lanes raw = exp2_of(hn::Max(exponent, all(kLeast)));
  const Lanes fade = hn::Mul(hn::Sub(raw, all(kInvisible)), all(1 / (kFadeFrom - kInvisible)));
  const Lanes faded = hn::Mul(raw, hn::Max(hn::Min(fade, all(1)), hn::Zero(kTag)));
  found.opacity = hn::IfThenElseZero(reached, hn::Min(faded, all(kOpaque)));
  return found;
}

/// Hides light; depth() and object() return what is seen there, 1/m and as ScreenSplat::object.
template <class Depth, class Object>
HWY_INLINE void Compositor::hide(Lanes weight, const Depth& depth, const Object& object, Block& block) {
  const Lanes before = load(block.transmittance), after = hn::Sub(before, weight);
  store(after, block.transmittance);
  const auto half = hn::And(hn::Ge(before, all(0.5F)), hn::Lt(after, all(0.5F)));
  if (!hn::AllFalse(kTag, half)) {
    store(hn::IfThenElse(half, depth(), load(block.nearness)), block.nearness);
    store(hn::IfThenElse(half, object(), load(block.object)), block.object);
  }
  if (hn::AllTrue(kTag, hn::Le(after, all(kFinished)))) block.finished = true, ++finished_;
}

template <bool kGrey>
void Compositor::blend_all() {
  for (const Listed& listed : splats_) {
    if (finished_ == kColumns * kRows) break;
    const ScreenSplat& splat = *listed.splat;
    for_each_block(listed, [&](Block& block, std::size_t, float x, float y) {
      const Overlap found = overlap(splat, x, y, block);
      if (!found.any) return;
      const Lanes weight = hn::Mul(load(block.transmittance), found.opacity);
      store(hn::MulAdd(weight, all(splat.colour[0]), load(block.red)), block.red);
      if constexpr (!kGrey) {
        store(hn::MulAdd(weight, all(splat.colour[1]), load(block.green)), block.green);
        store(hn::MulAdd(weight, all(splat.colour[2]), load(block.blue)), block.blue);
      }
      hide(
          weight, [&] { return nearness_at(splat, found.dx, found.dy); }, [&] { return all(splat.object); }, block);
    });
  }
}

/// Finds the bounds and the colours of the sorted list.
void Compositor::find_bounds() {
  constexpr float kRounding = 1e-6F;  // more than that of nearness_at()
  bounds_.resize(splats_.size()), colours_.resize(splats_.size());
  float bound = 0;
  for (std::size_t i = splats_.size(); i-- > 0;) {
    const ScreenSplat& splat = *splats_[i].splat;
    const auto largest = [](float slope, float first) {
      const float last = first + (kSide - 1);
      return std::array{std::max(slope * first, slope * last),
                        std::abs(slope) * std::max(std::abs(first), std::abs(last))};
    };
    const auto [across, size_across] = largest(splat.right, static_cast<float>(left_) - splat.x);
    const auto [down, size_down] = largest(splat.down, static_cast<float>(top_) - splat.y);
    const float linear = splat.nearness + across + down + kRounding * (splat.nearness + size_across + size_down);
    const float here = linear < splat.nearest ? std::max(linear, splat.farthest) : splat.nearest;  // not a number, too
    const float tie = tie_break(splat);
    bound = std::max(bound, here + (1 + kRounding) * tie);
    bounds_[i] = bound;
    colours_[i] = {splat.colour[0], splat.colour[1], splat.colour[2], splat.object, tie};
  }
}

template <bool kGrey>
void Compositor::blend_by_ray() {
  find_bounds();
  for (RayWindow& window : windows_) window.clear();
  for (std::size_t i = 0; i < splats_.size() && finished_ < kColumns * kRows; ++i) {
    const ScreenSplat& splat = *splats_[i].splat;
    for_each_block(splats_[i], [&](Block& block, std::size_t number, float x, float y) {
      blend_front<kGrey>(windows_[number], bounds_[i], block);
      if (block.finished) return;
      const Overlap found = overlap(splat, x, y, block);
      if (!found.any) return;
      const Lanes key = hn::Add(nearness_at(splat, found.dx, found.dy), all(tie_break(splat)));
      windows_[number].insert(key, found.opacity, static_cast<std::int32_t>(i));
    });
  }
  for (std::size_t i = 0; i < blocks_.size(); ++i) blend_front<kGrey>(windows_[i], 0, blocks_[i]);
}

/// Blends the splats of a window that are at least as near as the bound in all pixels.
template <bool kGrey>
void Compositor::blend_front(RayWindow& window, float bound, Block& block) {
  const hn::RebindToSigned<LanesTag> integers;
  for (; !window.empty() && !block.finished; window.pop()) {
    const RayWindow::Row& row = window.front();
    const Lanes key = load(row.key), before = load(block.transmittance);
    if (!hn::AllFalse(kTag, hn::Lt(key, all(bound)))) return;
    const auto place = hn::Mul(hn::Load(integers, row.splat.data()), hn::Set(integers, kFields));
    const auto of_splats = [&](int field) { return hn::GatherIndex(kTag, colours_.front().data() + field, place); };
    const Lanes opacity = hn::IfThenElseZero(hn::Gt(before, all(kFinished)), load(row.opacity));
    const Lanes weight = hn::Mul(before, opacity);
    store(hn::MulAdd(weight, of_splats(0), load(block.red)), block.red);
    if constexpr (!kGrey) {
      store(hn::MulAdd(weight, of_splats(1), load(block.green)), block.green);
      store(hn::MulAdd(weight, of_splats(2), load(block.blue)), block.blue);
    }
    hide(
        weight, [&] { return hn::Sub(key, of_splats(4)); }, [&] { return of_splats(3); }, block);
  }
}

}  // namespace esim::inline backends::inline splats
