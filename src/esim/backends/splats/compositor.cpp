#include "esim/backends/splats/compositor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/backends/splats/projection.h"

namespace esim::inline backends::inline splats {
namespace {

constexpr float kOpaque = 0.99F;         // the largest opacity, as in the original 3D Gaussian splatting
constexpr float kFinished = 1e-4F;       // transmittance below which pixels are finished, likewise
constexpr float kNowhere = 1e30F;        // nearness of contributions that are not there

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

}  // namespace

void Compositor::start(int left, int top) {
  left_ = left, top_ = top;
  splats_.clear();
  finished_ = 0;
  for (Block& block : blocks_) {
    for (Row* row : {&block.red, &block.green, &block.blue, &block.half_nearness, &block.half_object, &block.surface})
      row->fill(0);
    block.transmittance.fill(1);
    block.first = block.count = 0;
    block.finished = false;
  }
}

void Compositor::set_surface(int column, int row, float nearness) {
  Block& block = blocks_[static_cast<std::size_t>(row / kBlockHeight * Bin::kColumns + column / kBlockWidth)];
  block.surface[static_cast<std::size_t>(row % kBlockHeight * kBlockWidth + column % kBlockWidth)] = nearness;
}

Compositor::Pixel Compositor::pixel(int column, int row) const {
  const Block& block = blocks_[static_cast<std::size_t>(row / kBlockHeight * Bin::kColumns + column / kBlockWidth)];
  const auto lane = static_cast<std::size_t>(row % kBlockHeight * kBlockWidth + column % kBlockWidth);
  return {{block.red[lane], block.green[lane], block.blue[lane]},
          block.transmittance[lane],
          block.half_nearness[lane],
          block.half_object[lane]};
}

/// Nearer splats have larger keys.
float Compositor::key_of(const ScreenSplat& splat) const {
  if (order_ == SplatOrder::distance) return -splat.distance;
  // In the bin's place that is nearest to the centre: beyond the splat, its depth means nothing.
  const auto within = [](float at, int first) {
    return std::clamp(at, static_cast<float>(first), static_cast<float>(first + Bin::kSide - 1));
  };
  const float dx = within(splat.x, left_) - splat.x, dy = within(splat.y, top_) - splat.y;
  return std::clamp(splat.nearness + splat.right * dx + splat.down * dy, splat.farthest, splat.nearest);
}

/// Sorts the splats, the nearest first, and equal ones in the order in which they were added.
void Compositor::sort() {
  if (order_ == SplatOrder::distance) {
    std::stable_sort(splats_.begin(), splats_.end(), [](const Listed& a, const Listed& b) { return a.key > b.key; });
    return;
  }
  // Two passes of a radix sort over 16 bits of the key: the ring corrects the rest.
  float low = std::numeric_limits<float>::infinity(), high = -low;
  for (const Listed& listed : splats_) low = std::min(low, listed.key), high = std::max(high, listed.key);
  const float scale = high > low ? 65535 / (high - low) : 0;
  const auto digits = [&](const Listed& listed) { return static_cast<std::uint32_t>((high - listed.key) * scale); };
  sorted_.resize(splats_.size());
  for (const int shift : {0, 8}) {
    std::array<std::uint32_t, 257> begins{};
    for (const Listed& listed : splats_) ++begins[(digits(listed) >> shift & 255) + 1];
    for (std::size_t i = 1; i < begins.size(); ++i) begins[i] += begins[i - 1];
    for (const Listed& listed : splats_) sorted_[begins[digits(listed) >> shift & 255]++] = listed;
    splats_.swap(sorted_);
  }
}

void Compositor::add(const ScreenSplat& splat, int left, int right, int top, int bottom) {
  const auto column = [&](int x) {
    return static_cast<std::uint8_t>(std::clamp(x - left_, 0, Bin::kSide - 1) / kBlockWidth);
  };
  const auto row = [&](int y) {
    return static_cast<std::uint8_t>(std::clamp(y - top_, 0, Bin::kSide - 1) / kBlockHeight);
  };
  splats_.push_back({key_of(splat), column(left), column(right), row(top), row(bottom), &splat});
}

void Compositor::composite() {
  sort();
  for (const Listed& listed : splats_) {
    if (finished_ == Bin::kBlocks) break;
    const ScreenSplat& splat = *listed.splat;
    for (int row = listed.first_row; row <= listed.last_row; ++row) {
      for (int column = listed.first_column; column <= listed.last_column; ++column) {
        Block& block = blocks_[static_cast<std::size_t>(row * Bin::kColumns + column)];
        if (block.finished) continue;
        add_to_block(splat, static_cast<float>(left_ + column * kBlockWidth) - splat.x,
                     static_cast<float>(top_ + row * kBlockHeight) - splat.y, block);
      }
    }
  }
  for (Block& block : blocks_) {
    for (; block.count > 0; --block.count, block.first = (block.first + 1) % kWaiting)
      take(block, block.waiting[block.first]);
  }
}

/// (x, y): from the splat's centre to the block's first pixel.
void Compositor::add_to_block(const ScreenSplat& splat, float x, float y, Block& block) {
  const Lanes dx = hn::Add(all(x), load(kPlaces.x)), dy = hn::Add(all(y), load(kPlaces.y));
  const Lanes exponent = hn::MulAdd(dx, hn::MulAdd(all(splat.xx), dx, hn::Mul(all(splat.xy), dy)),
                                    hn::MulAdd(hn::Mul(all(splat.yy), dy), dy, all(splat.peak)));
  constexpr float kLeast = -8.9943534F;  // log2(kInvisible)
  const auto reached = hn::And(hn::Gt(exponent, all(kLeast)), hn::Gt(load(block.transmittance), all(kFinished)));
  if (hn::AllFalse(kTag, reached)) return;

  const Lanes raw = exp2_of(hn::Max(exponent, all(kLeast)));
  const Lanes fade = hn::Min(hn::Mul(hn::Sub(raw, all(kInvisible)), all(1 / (kFadeFrom - kInvisible))), all(1));
  const Lanes opacity =
      hn::IfThenElseZero(reached, hn::Min(hn::Mul(raw, hn::Max(fade, hn::Zero(kTag))), all(kOpaque)));
  const Lanes linear = hn::MulAdd(all(splat.right), dx, hn::MulAdd(all(splat.down), dy, all(splat.nearness)));
  const Lanes nearness = hn::Min(hn::Max(linear, all(splat.farthest)), all(splat.nearest));
  wait(block, splat, opacity, nearness);
}

/// Puts a contribution to where it belongs among those that wait; the nearest one is composited if there are too many.
void Compositor::wait(Block& block, const ScreenSplat& splat, Lanes opacity, Lanes nearness) {
  if (block.count == kWaiting) {
    take(block, block.waiting[block.first]);
    block.first = (block.first + 1) % kWaiting;
    --block.count;
  }
  std::size_t at = (block.first + block.count) % kWaiting;
  Contribution* to = &block.waiting[at];
  const bool sorted = order_ == SplatOrder::distance;
  // Lanes that are not reached wait behind the last one.
  const auto reached = hn::Gt(opacity, hn::Zero(kTag));
  const Lanes last =
      block.count > 0 ? load(block.waiting[(at + kWaiting - 1) % kWaiting].nearness) : all(kNowhere);
  Lanes key = hn::IfThenElse(reached, nearness, last);
  store(key, to->nearness), store(opacity, to->opacity);
  store(all(splat.colour[0]), to->red), store(all(splat.colour[1]), to->green);
  store(all(splat.colour[2]), to->blue), store(all(splat.object), to->object);
  for (std::size_t i = 0; i < block.count && !sorted; ++i) {
    at = (at + kWaiting - 1) % kWaiting;
    Contribution* before = &block.waiting[at];
    const auto nearer = hn::Gt(key, load(before->nearness));
    if (hn::AllFalse(kTag, nearer)) break;
    for (Row Contribution::* field : {&Contribution::nearness, &Contribution::opacity, &Contribution::red,
                                      &Contribution::green, &Contribution::blue, &Contribution::object}) {
      const Lanes a = load(before->*field), b = load(to->*field);
      store(hn::IfThenElse(nearer, b, a), before->*field), store(hn::IfThenElse(nearer, a, b), to->*field);
    }
    key = load(before->nearness);
    to = before;
  }
  ++block.count;
}

void Compositor::take(Block& block, const Contribution& contribution) {
  const Lanes nearness = load(contribution.nearness), before = load(block.transmittance);
  const Lanes opacity = hn::IfThenZeroElse(hn::Le(nearness, load(block.surface)), load(contribution.opacity));
  const Lanes weight = hn::Mul(before, opacity), after = hn::Sub(before, weight);
  store(hn::MulAdd(weight, load(contribution.red), load(block.red)), block.red);
  store(hn::MulAdd(weight, load(contribution.green), load(block.green)), block.green);
  store(hn::MulAdd(weight, load(contribution.blue), load(block.blue)), block.blue);
  store(after, block.transmittance);
  const auto half = hn::And(hn::Ge(before, all(0.5F)), hn::Lt(after, all(0.5F)));
  store(hn::IfThenElse(half, nearness, load(block.half_nearness)), block.half_nearness);
  store(hn::IfThenElse(half, load(contribution.object), load(block.half_object)), block.half_object);
  if (hn::AllTrue(kTag, hn::Le(after, all(kFinished)))) {
    if (!block.finished) ++finished_;
    block.finished = true;
  }
}

}  // namespace esim::inline backends::inline splats
