#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

// Private to reproject: includes hwy/highway.h.
namespace esim::inline reproject {

namespace hn = hwy::HWY_NAMESPACE;

/// Points that are looked up side by side: at most 8.
using LookupTag = hn::CappedTag<float, 8>;
using LookupLanes = hn::Vec<LookupTag>;
inline constexpr LookupTag kLookupTag;
inline constexpr std::size_t kLookupLanes = hn::MaxLanes(LookupTag());
static_assert(kLookupLanes == 4 || kLookupLanes == 8);

/// The next `count` values, and zeros behind them if these are too few.
template <class T>
HWY_INLINE hn::Vec<hn::Rebind<T, LookupTag>> load_some(const T* from, std::size_t count) {
  const hn::Rebind<T, LookupTag> tag;
  if (count >= kLookupLanes) return hn::LoadU(tag, from);
  alignas(32) std::array<T, kLookupLanes> some{};
  std::copy_n(from, count, some.data());
  return hn::Load(tag, some.data());
}

/// Stores numbers of 64 bits, given their halves.
HWY_INLINE void store_pairs(hn::Vec<hn::Rebind<std::uint32_t, LookupTag>> high,
                            hn::Vec<hn::Rebind<std::uint32_t, LookupTag>> low, std::uint64_t* to) {
  static_assert(std::endian::native == std::endian::little);
  hn::StoreInterleaved2(low, high, hn::Rebind<std::uint32_t, LookupTag>(), reinterpret_cast<std::uint32_t*>(to));
}

/// CubicSpline for points side by side.
struct LaneSpline {
  LookupLanes w0, w1, w2, w3;

  HWY_INLINE explicit LaneSpline(LookupLanes f) {
    const auto all = [](float value) { return hn::Set(kLookupTag, value); };
    const LookupLanes g = hn::Sub(all(1), f), ff = hn::Mul(f, f), gg = hn::Mul(g, g);
    w0 = hn::Mul(hn::Mul(gg, g), all(1.0F / 6));
    w1 = hn::MulAdd(ff, hn::MulSub(all(0.5F), f, all(1)), all(2.0F / 3));
    w2 = hn::MulAdd(gg, hn::MulSub(all(0.5F), g, all(1)), all(2.0F / 3));
    w3 = hn::Mul(hn::Mul(ff, f), all(1.0F / 6));
  }

  HWY_INLINE LookupLanes operator()(const std::array<LookupLanes, 4>& c) const {
    return hn::MulAdd(w3, c[3], hn::MulAdd(w2, c[2], hn::MulAdd(w0, c[0], hn::Mul(w1, c[1]))));
  }
};

using LanePlaces = std::array<std::int32_t, kLookupLanes>;

/// Places in an image: the pixels at or before them, as indices, and how far they are beyond these.
struct LanesOfPlaces {
  alignas(32) LanePlaces first;
  LookupLanes beyond_column, beyond_line;

  HWY_INLINE LanesOfPlaces(LookupLanes column, LookupLanes line, int stride) {
    const hn::RebindToSigned<LookupTag> integers;
    const auto i = hn::ConvertTo(integers, column), j = hn::ConvertTo(integers, line);
    beyond_column = hn::Sub(column, hn::ConvertTo(kLookupTag, i));
    beyond_line = hn::Sub(line, hn::ConvertTo(kLookupTag, j));
    hn::Store(hn::Add(hn::Mul(j, hn::Set(integers, stride)), i), integers, first.data());
  }
};

/// Sorts four numbers per lane by their place: load(lane) returns those of a lane. Gathering them one by one would take
/// twice as long.
template <class Load>
HWY_INLINE std::array<LookupLanes, 4> transposed(const Load& load) {
  const auto both = [&](std::size_t lane) {
    if constexpr (kLookupLanes == 8) {
      return hn::Combine(kLookupTag, load(lane + 4), load(lane));
    } else {
      return load(lane);
    }
  };
  const hn::Repartition<double, LookupTag> pairs;
  const auto as_pairs = [&](LookupLanes lanes) { return hn::BitCast(pairs, lanes); };
  const LookupLanes v0 = both(0), v1 = both(1), v2 = both(2), v3 = both(3);
  const auto low01 = as_pairs(hn::InterleaveLower(kLookupTag, v0, v1)),
             low23 = as_pairs(hn::InterleaveLower(kLookupTag, v2, v3)),
             high01 = as_pairs(hn::InterleaveUpper(kLookupTag, v0, v1)),
             high23 = as_pairs(hn::InterleaveUpper(kLookupTag, v2, v3));
  return {hn::BitCast(kLookupTag, hn::InterleaveLower(pairs, low01, low23)),
          hn::BitCast(kLookupTag, hn::InterleaveUpper(pairs, low01, low23)),
          hn::BitCast(kLookupTag, hn::InterleaveLower(pairs, high01, high23)),
          hn::BitCast(kLookupTag, hn::InterleaveUpper(pairs, high01, high23))};
}

/// Four pixels side by side from each place on.
HWY_INLINE std::array<LookupLanes, 4> fours_at(const float* image, const LanePlaces& places) {
  return transposed([&](std::size_t lane) { return hn::LoadU(hn::FixedTag<float, 4>(), image + places[lane]); });
}

/// The pixels at each place, to its right, below, and right below.
HWY_INLINE std::array<LookupLanes, 4> squares_at(const float* image, const LanePlaces& places, int stride) {
  return transposed([&](std::size_t lane) {
    const hn::FixedTag<float, 2> pair;
    const float* const at = image + places[lane];
    return hn::Combine(hn::FixedTag<float, 4>(), hn::LoadU(pair, at + stride), hn::LoadU(pair, at));
  });
}

}  // namespace esim::inline reproject
