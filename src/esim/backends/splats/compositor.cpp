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

void Compositor::add(const ScreenSplat& splat, float order, int left, int right, int top, int bottom) {
  const auto column = [&](int x) {
    return static_cast<std::uint8_t>(std::clamp(x - left_, 0, kSide - 1) / kBlockWidth);
  };
  const auto row = [&](int y) { return static_cast<std::uint8_t>(std::clamp(y - top_, 0, kSide - 1) / kBlockHeight); };
  splats_.push_back({std::bit_cast<std::uint32_t>(order), column(left), column(right), row(top), row(bottom), &splat});
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
  grey_ ? blend_all<true>() : blend_all<false>();
}

template <bool kGrey>
void Compositor::blend_all() {
  for (const Listed& listed : splats_) {
    if (finished_ == kColumns * kRows) break;
    const ScreenSplat& splat = *listed.splat;
    for (int row = listed.first_row; row <= listed.last_row; ++row) {
      for (int column = listed.first_column; column <= listed.last_column; ++column) {
        Block& block = blocks_[static_cast<std::size_t>(row * kColumns + column)];
        if (block.finished) continue;
        add_to_block<kGrey>(splat, static_cast<float>(left_ + column * kBlockWidth) - splat.x,
                            static_cast<float>(top_ + row * kBlockHeight) - splat.y, block);
      }
    }
  }
}

/// (x, y): from the splat's centre to the block's first pixel.
template <bool kGrey>
void Compositor::add_to_block(const ScreenSplat& splat, float x, float y, Block& block) {
  const Lanes dx = hn::Add(all(x), load(kPlaces.x)), dy = hn::Add(all(y), load(kPlaces.y));
  const Lanes exponent = hn::MulAdd(dx, hn::MulAdd(all(splat.xx), dx, hn::Mul(all(splat.xy), dy)),
                                    hn::MulAdd(hn::Mul(all(splat.yy), dy), dy, all(splat.peak)));
  constexpr float kLeast = -8.9943534F;  // log2(kInvisible)
  const Lanes before = load(block.transmittance);
  auto reached = hn::And(hn::Gt(exponent, all(kLeast)), hn::Gt(before, all(kFinished)));
  if (hn::AllFalse(kTag, reached)) return;

  const auto depth_here = [&] {
    const Lanes linear = hn::MulAdd(all(splat.right), dx, hn::MulAdd(all(splat.down), dy, all(splat.nearness)));
    return hn::Min(hn::Max(linear, all(splat.farthest)), all(splat.nearest));
  };
  if (surfaces_) reached = hn::And(reached, hn::Gt(depth_here(), load(block.surface)));
  const Lanes raw = exp2_of(hn::Max(exponent, all(kLeast)));
  const Lanes fade = hn::Mul(hn::Sub(raw, all(kInvisible)), all(1 / (kFadeFrom - kInvisible)));
  const Lanes faded = hn::Mul(raw, hn::Max(hn::Min(fade, all(1)), hn::Zero(kTag)));
  const Lanes weight = hn::IfThenElseZero(reached, hn::Mul(before, hn::Min(faded, all(kOpaque))));
  const Lanes after = hn::Sub(before, weight);
  store(hn::MulAdd(weight, all(splat.colour[0]), load(block.red)), block.red);
  if constexpr (!kGrey) {
    store(hn::MulAdd(weight, all(splat.colour[1]), load(block.green)), block.green);
    store(hn::MulAdd(weight, all(splat.colour[2]), load(block.blue)), block.blue);
  }
  store(after, block.transmittance);
  const auto half = hn::And(hn::Ge(before, all(0.5F)), hn::Lt(after, all(0.5F)));
  if (!hn::AllFalse(kTag, half)) {
    store(hn::IfThenElse(half, depth_here(), load(block.nearness)), block.nearness);
    store(hn::IfThenElse(half, all(splat.object), load(block.object)), block.object);
  }
  if (hn::AllTrue(kTag, hn::Le(after, all(kFinished)))) block.finished = true, ++finished_;
}

}  // namespace esim::inline backends::inline splats
