#pragma once

#include <array>
#include <cstdint>

#include "esim/scene/images/texture.h"

// The second part of texture.h: how it is sampled.
namespace esim::inline scene {

template <int K>
std::array<float, K> Texture::sample(const TextureLookup<K>& at, std::uint32_t lanes) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<float, K> d;
  using V = hn::Vec<decltype(d)>;
  constexpr std::size_t kVector = hn::MaxLanes(decltype(d)());
  const hn::RebindToSigned<decltype(d)> di;
  const V zero = hn::Zero(d);
  alignas(64) std::array<float, K> result;

  const auto for_each_vector = [lanes](const auto& function) {
    for (std::size_t i = 0; i < K; i += kVector) {
      if ((lanes >> i & ((std::uint64_t{1} << kVector) - 1)) != 0) function(i);
    }
  };
  std::array<Moments<V>, K / kVector> spreads;
  V widest = zero;
  for (std::size_t i = 0; i < K; i += kVector) {
    Moments<V>& spread = spreads[i / kVector];
    spread = moments(d, at, i);
    widest = hn::Max(widest, hn::Max(spread.uu, spread.vv));
  }
  if (hn::AllTrue(d, hn::Lt(widest, hn::Set(d, 0.99F * kNarrowBox2)))) {
    // Close view: here the general code gives the same result.
    for_each_vector([&](std::size_t i) {
      const V value = interpolated(d, hn::Load(d, &at.u[i]), hn::Load(d, &at.v[i]));
      hn::Store(hn::Mul(value, hn::Set(d, scale_)), d, &result[i]);
    });
    return result;
  }

  // First for all vectors, so that none waits for another.
  std::array<Footprint<V>, K / kVector> footprints;
  for (std::size_t i = 0; i < K; i += kVector) footprints[i / kVector] = footprint(d, spreads[i / kVector]);
  for_each_vector([&](std::size_t i) {
    const Footprint<V>& f = footprints[i / kVector];
    const V u = hn::Load(d, &at.u[i]), v = hn::Load(d, &at.v[i]);
    const V level = hn::Floor(f.lod);
    const auto finer = to_integer(d, level);
    V value = mean(d, f, u, v, grid(d, finer));
    const V fraction = hn::Mul(hn::Sub(hn::Sub(f.lod, level), hn::Set(d, 1 - kBlend)), hn::Set(d, 1 / kBlend));
    if (!hn::AllTrue(d, hn::Le(fraction, zero))) {
      const auto coarser = hn::Min(hn::Add(finer, hn::Set(di, 1)), hn::Set(di, levels_ - 1));
      value = hn::MulAdd(hn::Max(fraction, zero), hn::Sub(mean(d, f, u, v, grid(d, coarser)), value), value);
    }
    hn::Store(hn::Mul(value, hn::Set(d, scale_)), d, &result[i]);
  });
  return result;
}

/// For the lanes from i on. With the sides a and b of a footprint, a parallelogram, these are a a^T + b b^T.
template <class D, class Lookup>
HWY_INLINE auto Texture::moments(D d, const Lookup& at, std::size_t i) const {
  namespace hn = hwy::HWY_NAMESPACE;
  using V = hn::Vec<D>;
  const V width = hn::Set(d, level_width_[0]), height = hn::Set(d, level_height_[0]);
  const V a_u = hn::Mul(hn::Load(d, &at.du_dx[i]), width), a_v = hn::Mul(hn::Load(d, &at.dv_dx[i]), height);
  const V b_u = hn::Mul(hn::Load(d, &at.du_dy[i]), width), b_v = hn::Mul(hn::Load(d, &at.dv_dy[i]), height);
  // The bounds keep a degenerate footprint (a pole, a horizon) finite.
  const V bound = hn::Set(d, 1e12F);
  return Moments<V>{hn::Min(hn::MulAdd(a_u, a_u, hn::Mul(b_u, b_u)), bound),
                    hn::Min(hn::Max(hn::MulAdd(a_u, a_v, hn::Mul(b_u, b_v)), hn::Neg(bound)), bound),
                    hn::Min(hn::MulAdd(a_v, a_v, hn::Mul(b_v, b_v)), bound)};
}

/// A part of the larger moment is left to the distance of the probes, so that the rest is nearly a rectangle along u
/// and v.
template <class D, class V>
HWY_INLINE auto Texture::footprint(D d, const Moments<V>& moments) const -> Footprint<V> {
  namespace hn = hwy::HWY_NAMESPACE;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F);
  const auto& [uu, uv, vv] = moments;
  const V middle = hn::Mul(hn::Add(uu, vv), half), apart = hn::Mul(hn::Sub(uu, vv), half);
  const V radius = hn::Sqrt(hn::MulAdd(apart, apart, hn::Mul(uv, uv)));
  const V major = hn::Add(middle, radius), minor = hn::Max(hn::Sub(middle, radius), zero);

  // Texels, and the longest row of probes, limit how narrow a footprint can be.
  constexpr float kMaxElongation2 = 1.5F * kMaxProbes * kMaxProbes, kTolerance = 0.2F, kRectangle2 = 1.25F;
  const V narrowest = hn::Mul(major, hn::Set(d, 1 / kMaxElongation2));
  const V extra = hn::Max(hn::Sub(narrowest, minor), zero);
  const V across = hn::Max(hn::Max(minor, narrowest), one);

  Footprint<V> f;
  f.step_u = f.step_v = zero, f.probes = f.per_probe = one;
  f.width2_u = hn::Add(uu, extra), f.width2_v = hn::Add(vv, extra);

  // `along` is left to the probes: what exceeds a rectangle, and what makes it oblique.
  const V oblique = hn::Max(hn::Abs(uv), hn::Set(d, 1e-20F));
  const V too_oblique = hn::Sub(one, hn::Div(hn::Mul(across, hn::Set(d, kTolerance)), oblique));
  const V too_long = hn::Sub(major, hn::Max(hn::Mul(hn::Set(d, kRectangle2), across), hn::Set(d, kFirstLevel2)));
  V along = hn::Max(zero, hn::Max(hn::Mul(hn::Add(radius, radius), too_oblique), too_long));
  if (!hn::AllTrue(d, hn::Le(along, zero))) {
    // n probes at a distance s have the square width (n^2 - 1) s^2. They are not farther apart than a probe is wide. If
    // the footprint is long enough, they are not closer either: so the row of probes ends where the footprint ends.
    const V width2 = hn::Max(hn::Sub(major, along), across);
    for (int n = 1; n < kMaxProbes; ++n) {
      const V longest = hn::Mul(hn::Set(d, static_cast<float>(n * n - 1)), width2);
      f.probes = hn::IfThenElse(hn::Gt(along, longest), hn::Set(d, static_cast<float>(n + 1)), f.probes);
    }
    const V side_by_side = hn::Mul(major, hn::Sub(one, hn::Div(one, hn::Mul(f.probes, f.probes))));
    along = hn::Max(along, hn::Min(side_by_side, hn::Add(radius, radius)));
    const V direction = hn::Mul(half, hn::Div(apart, hn::Max(radius, hn::Set(d, 1e-20F))));
    const V part_u = hn::Mul(along, hn::Add(half, direction)), part_v = hn::Mul(along, hn::Sub(half, direction));
    f.width2_u = hn::Max(hn::Sub(f.width2_u, part_u), zero), f.width2_v = hn::Max(hn::Sub(f.width2_v, part_v), zero);
    const V per_distance = hn::Max(hn::MulSub(f.probes, f.probes, one), one);
    f.per_probe = hn::Div(one, f.probes);
    const auto distance = [&](V part, float size) {
      return hn::Mul(hn::Sqrt(hn::Max(hn::Div(part, per_distance), zero)), hn::Set(d, 1 / size));
    };
    f.step_u = distance(part_u, level_width_[0]);
    f.step_v = hn::CopySign(distance(part_v, level_height_[0]), uv);
  }
  const V width2 = hn::Max(hn::Max(f.width2_u, f.width2_v), one);
  const V lod = hn::Add(binary_logarithm(d, hn::Mul(width2, hn::Set(d, 1 / kWidestBox2))), one);
  f.lod = hn::Min(hn::Max(lod, zero), hn::Set(d, static_cast<float>(levels_ - 1)));
  return f;
}

/// Converts integers from 0 to 2^22, which are the last bits of the number plus 2^23. A general conversion takes three
/// times as long.
template <class D, class V>
HWY_INLINE auto Texture::to_integer(D d, V x) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  return hn::And(hn::BitCast(di, hn::Add(x, hn::Set(d, 8388608.0F))), hn::Set(di, 0x007fffff));
}

/// fast_log2() of each lane.
template <class D, class V>
HWY_INLINE V Texture::binary_logarithm(D d, V x) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const auto bits = hn::BitCast(di, x);
  const V exponent = hn::ConvertTo(d, hn::Sub(hn::ShiftRight<23>(bits), hn::Set(di, 127)));
  const V mantissa = hn::BitCast(d, hn::Or(hn::And(bits, hn::Set(di, 0x007fffff)), hn::Set(di, 0x3f800000)));
  const V m = hn::Sub(mantissa, hn::Set(d, 1.0F));
  V q = hn::MulAdd(m, hn::Set(d, 0.02584142F), hn::Set(d, -0.0959564F));
  q = hn::MulAdd(m, q, hn::Set(d, 0.18194884F));
  q = hn::MulAdd(m, q, hn::Set(d, -0.2756003F));
  q = hn::MulAdd(m, q, hn::Set(d, 0.44254494F));
  return hn::Add(hn::Add(exponent, m), hn::Mul(hn::NegMulAdd(m, m, m), q));
}

template <class D, class I>
HWY_INLINE auto Texture::grid(D d, I level) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  using AnyGrid = Grid<hn::Vec<D>, I>;
  // Neighbouring pixels usually sample the same level, and broadcasts are much cheaper than gathers.
  const std::int32_t first = hn::GetLane(level);
  if (hn::AllTrue(di, hn::Eq(level, hn::Set(di, first)))) {
    const auto i = static_cast<std::size_t>(first);
    const auto all = [&](const auto& values) { return hn::Set(d, values[i]); };
    return AnyGrid{all(level_width_),
                   all(level_height_),
                   all(level_squared_u_),
                   all(level_squared_v_),
                   all(level_blur_),
                   hn::Set(di, level_offset_[i]),
                   hn::Set(di, level_stride_[i])};
  }
  const auto each = [&](const auto& values) { return hn::GatherIndex(d, values.data(), level); };
  return AnyGrid{each(level_width_),
                 each(level_height_),
                 each(level_squared_u_),
                 each(level_squared_v_),
                 each(level_blur_),
                 hn::GatherIndex(di, level_offset_.data(), level),
                 hn::GatherIndex(di, level_stride_.data(), level)};
}

/// The first of the four taps around a coordinate, counted from the continuation, and the position t between the two in
/// the middle. Texel centres are at half-integers. NaN becomes a position in the image.
template <class D, class V>
HWY_INLINE void Texture::locate(D d, V coordinate, V size, Wrap wrap, V& first, V& t) {
  namespace hn = hwy::HWY_NAMESPACE;
  const V one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F);
  V x;
  if (wrap == Wrap::repeat) {
    const V unit = hn::Min(hn::Max(hn::Sub(coordinate, hn::Floor(coordinate)), hn::Zero(d)), one);
    x = hn::MulSub(unit, size, half);
  } else {
    // Farther beyond an edge, all taps are on the continuation.
    x = hn::Min(hn::Max(hn::MulSub(coordinate, size, half), hn::Set(d, -2.0F)), hn::Add(size, one));
  }
  const V floor = hn::Floor(x);
  t = hn::Sub(x, floor);
  first = hn::Add(floor, hn::Set(d, static_cast<float>(kBefore - 1)));
}

/// The byte of codes_ at which the 4 x 4 taps from this column and row on begin.
template <class D, class V, class I>
HWY_INLINE I Texture::position(D d, V column, V row, const Grid<V, I>& on) {
  namespace hn = hwy::HWY_NAMESPACE;
  const V half = hn::Set(d, 0.5F);
  const auto block = [&](V x, int step) {
    return hn::Floor(hn::Mul(hn::Add(x, half), hn::Set(d, 1 / static_cast<float>(step))));
  };
  constexpr int kStepU = kBlockWidth - kOverlap, kStepV = kBlockHeight - kOverlap;
  const V block_u = block(column, kStepU), block_v = block(row, kStepV);
  const V in_u = hn::NegMulAdd(block_u, hn::Set(d, float{kStepU}), column);
  const V in_v = hn::NegMulAdd(block_v, hn::Set(d, float{kStepV}), row);
  const V in_block = hn::MulAdd(in_v, hn::Set(d, float{kBlockRowBytes}), hn::Add(in_u, in_u));
  const I begin = hn::Add(on.offset, hn::Mul(to_integer(d, block_v), on.stride));
  return hn::Add(hn::Add(begin, hn::Mul(to_integer(d, block_u), hn::Set(hn::RebindToSigned<D>(), kBlockBytes))),
                 to_integer(d, in_block));
}

/// The two texels in each word.
template <class D, class W>
HWY_INLINE auto Texture::decoded(D d, W words) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToUnsigned<D> du;
  const auto bias = hn::Set(du, kCodeBias);
  const auto left = hn::ShiftLeft<kCodeShift>(hn::And(words, hn::Set(du, 0xffffU)));
  const auto right = hn::And(hn::ShiftRight<16 - kCodeShift>(words), hn::Set(du, 0xffffU << kCodeShift));
  return TwoOf<hn::Vec<D>>{hn::BitCast(d, hn::Add(left, bias)), hn::BitCast(d, hn::Add(right, bias))};
}

/// Two neighbouring texels of a row, from a byte of codes_ on.
template <class D, class I>
HWY_INLINE auto Texture::two_texels(D d, I position) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToUnsigned<D> du;
  return decoded(d, hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(codes_.data()), position));
}

#if HWY_TARGET != HWY_SCALAR  // programs that include this header may be compiled without vectors
/// The words at these bytes after `from`. Single loads are faster than gathering words of this size.
template <class D>
HWY_INLINE auto Texture::words(D d, const char* from, const std::int32_t* bytes) {
  namespace hn = hwy::HWY_NAMESPACE;
  if constexpr (hn::MaxLanes(D()) == 1) {
    return hn::LoadU(d, reinterpret_cast<const hn::TFromD<D>*>(from + *bytes));
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, words(half, from, bytes + hn::MaxLanes(half)), words(half, from, bytes));
  }
}
#endif

/// Four neighbouring texels of a row, from these bytes after `from` on.
template <class D>
HWY_INLINE auto Texture::four_texels(D d, const char* from, const std::int32_t* bytes) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToUnsigned<D> du;
#if HWY_TARGET == HWY_SCALAR
  const auto two = [&](const char* at) {
    return decoded(d, hn::LoadU(du, reinterpret_cast<const std::uint32_t*>(at + *bytes)));
  };
  const auto [first, second] = two(from);
  const auto [third, fourth] = two(from + 4);
#else
  const hn::Repartition<std::uint64_t, D> du64;
  const auto lower = hn::BitCast(du, words(du64, from, bytes));
  const auto upper = hn::BitCast(du, words(du64, from, bytes + hn::MaxLanes(D()) / 2));
  const auto [first, second] = decoded(d, hn::ConcatEven(du, upper, lower));
  const auto [third, fourth] = decoded(d, hn::ConcatOdd(du, upper, lower));
#endif
  return FourOf<hn::Vec<D>>{first, second, third, fourth};
}

/// The bilinear interpolation between texels.
template <class D, class V>
HWY_INLINE V Texture::interpolated(D d, V u, V v) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const V one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F);
  V column, row, t_u, t_v;
  locate(d, u, hn::Set(d, level_width_[0]), wrap_u_, column, t_u);
  locate(d, v, hn::Set(d, level_height_[0]), wrap_v_, row, t_v);
  const V left = hn::Add(hn::Sub(half, t_u), half), above = hn::Add(hn::Sub(half, t_v), half);
  const V right = hn::Sub(one, left), below = hn::Sub(one, above);
  // Those in the middle of the 4 x 4 taps.
  const auto upper = hn::Add(position(d, column, row, grid(d, hn::Zero(di))), hn::Set(di, kBlockRowBytes + 2));
  const auto lower = hn::Add(upper, hn::Set(di, kBlockRowBytes));
  const auto mean_of_row = [&](auto at) {
    const auto [first, second] = two_texels(d, at);
    return hn::MulAdd(right, second, hn::Mul(left, first));
  };
  return hn::MulAdd(below, mean_of_row(lower), hn::Mul(above, mean_of_row(upper)));
}

template <class D, class V, class I>
HWY_INLINE V Texture::mean(D d, const Footprint<V>& f, V u, V v, const Grid<V, I>& on) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const BoxFilter<D> filter_u(d, hn::Mul(f.width2_u, on.squared_u), on.blur);
  const BoxFilter<D> filter_v(d, hn::Mul(f.width2_v, on.squared_v), on.blur);
  const auto* const codes = reinterpret_cast<const char*>(codes_.data());

  const auto probe_at = [&](V at_u, V at_v) {
    V column, row, t_u, t_v;
    locate(d, at_u, on.width, wrap_u_, column, t_u);
    locate(d, at_v, on.height, wrap_v_, row, t_v);
    const FourOf<V> across = filter_u.weights(t_u), down = filter_v.weights(t_v);
    alignas(64) std::array<std::int32_t, hn::MaxLanes(D())> bytes;
    hn::Store(position(d, column, row, on), hn::RebindToSigned<D>(), bytes.data());
    const auto mean_of_row = [&](int k) {
      const FourOf<V> texels = four_texels(d, codes + k * kBlockRowBytes, bytes.data());
      const V middle = hn::MulAdd(across.third, texels.third, hn::Mul(across.second, texels.second));
      return hn::MulAdd(across.fourth, texels.fourth, hn::MulAdd(across.first, texels.first, middle));
    };
    const V middle = hn::MulAdd(down.third, mean_of_row(2), hn::Mul(down.second, mean_of_row(1)));
    return hn::MulAdd(down.fourth, mean_of_row(3), hn::MulAdd(down.first, mean_of_row(0), middle));
  };

  const float max_probes = hn::GetLane(hn::MaxOfLanes(d, f.probes));
  if (max_probes == 1) return probe_at(u, v);
  V sum = hn::Zero(d);
  const V middle = hn::Mul(hn::Set(d, 0.5F), hn::Sub(f.probes, hn::Set(d, 1.0F)));
  for (float probe = 0; probe < max_probes; ++probe) {
    const V steps = hn::Sub(hn::Set(d, probe), middle);
    const V value = probe_at(hn::MulAdd(steps, f.step_u, u), hn::MulAdd(steps, f.step_v, v));
    sum = hn::MulAdd(hn::IfThenElseZero(hn::Lt(hn::Set(d, probe), f.probes), f.per_probe), value, sum);
  }
  return sum;
}

}  // namespace esim::inline scene
