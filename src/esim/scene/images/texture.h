#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "esim/core/image.h"

namespace esim::inline scene {

/// How a texture continues beyond its edges.
enum class Wrap { repeat, clamp };

/// Texture coordinates of K pixels, and their footprints. u points to the right, v downwards; the image spans
/// [0, 1] x [0, 1]. One array per quantity, for SIMD code; K is 4 or a multiple of 8.
template <int K>
struct TextureLookup {
  alignas(64) std::array<float, K> u, v;
  alignas(64) std::array<float, K> du_dx, dv_dx;  // change of (u, v) over one pixel to the right
  alignas(64) std::array<float, K> du_dy, dv_dy;  // change of (u, v) over one pixel downwards
};

/// A linear-light image that can be averaged over a pixel's footprint: a mip pyramid, sampled trilinearly at up to
/// kMaxProbes positions along the longer side of the footprint, so that there is no aliasing at large distances or
/// grazing angles.
///
/// Since rendering is limited by memory bandwidth, a texel is stored in 16 bits: an unsigned floating-point number with
/// 11 bits of mantissa, relative to the brightest texel. The relative error is at most 2^-12, far below that of 8-bit
/// images, down to 2^-31 of the brightest texel; darker texels are raised to that. Values that are negative or not a
/// number become 0.
class Texture {
 public:
  Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v);

  /// Mean of the texture over each of the K footprints. Lanes whose bit in `lanes` is not set are undefined.
  template <int K>
  std::array<float, K> sample(const TextureLookup<K>& at, std::uint32_t lanes = ~0U) const;

  int width() const { return static_cast<int>(level_width_[0]); }
  int height() const { return static_cast<int>(level_height_[0]); }

  Wrap wrap_u() const { return wrap_u_; }
  Wrap wrap_v() const { return wrap_v_; }

  /// The stored texels at full resolution.
  Image<float> texels() const;

 private:
  static constexpr int kMaxLevels = 18;
  static constexpr int kMaxProbes = 4;

  // A code is the upper 16 bits of value / scale_ as a float, without those that are the same in all: see encode().
  static constexpr int kCodeShift = 12;
  static constexpr std::uint32_t kCodeBias = 96U << 23;

  /// The mip levels that the lanes of a vector sample.
  template <class V, class I>
  struct Grid {
    V width, height;       // texels
    I offset, row_stride;  // bytes
  };

  /// The footprints of pixels on the texture.
  template <class V>
  struct Footprint {
    V step_u, step_v;     // the longer side
    V probes, per_probe;  // along it; 1 / probes
    V lod;                // level of the mip pyramid
  };

  std::uint16_t encode(float value) const;
  template <class D, class Lookup>
  auto sides2(D d, const Lookup& at, std::size_t i) const;
  template <class D, class Lookup>
  auto largest_side2(D d, const Lookup& at, std::size_t i) const;
  template <class D, class Lookup>
  auto footprint(D d, const Lookup& at, std::size_t i) const;
  template <class D, class I>
  auto grid(D d, I level) const;
  template <class D, class V>
  static V binary_logarithm(D d, V x);
  template <class D, class V>
  static auto to_integer(D d, V x);
  template <class D, class V, class I>
  V bilinear(D d, V u, V v, const Grid<V, I>& on) const;
  template <class D, class V>
  static V wrapped(D d, V coordinate, Wrap wrap);

  Wrap wrap_u_, wrap_v_;
  int levels_ = 0;
  float scale_ = 1;
  std::array<float, kMaxLevels> level_width_{}, level_height_{};
  std::array<std::int32_t, kMaxLevels> level_offset_{}, level_stride_{};  // bytes
  std::vector<std::uint16_t> codes_;  // all levels, row-major; each row and column is followed by its continuation
};

template <int K>
std::array<float, K> Texture::sample(const TextureLookup<K>& at, std::uint32_t lanes) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<float, K> d;
  using V = hn::Vec<decltype(d)>;
  constexpr std::size_t kVector = hn::MaxLanes(decltype(d)());
  const hn::RebindToSigned<decltype(d)> di;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  alignas(64) std::array<float, K> result;

  const auto skips = [lanes](std::size_t i) { return (lanes >> i & ((std::uint64_t{1} << kVector) - 1)) == 0; };

  V largest2 = zero;
  for (std::size_t i = 0; i < K; i += kVector) largest2 = hn::Max(largest2, largest_side2(d, at, i));
  if (hn::AllTrue(d, hn::Le(largest2, one))) {
    // Close view: footprints within a texel, where the general code gives the same result.
    const auto finest = grid(d, hn::Zero(di));
    for (std::size_t i = 0; i < K; i += kVector) {
      if (skips(i)) continue;
      const V u = wrapped(d, hn::Load(d, &at.u[i]), wrap_u_), v = wrapped(d, hn::Load(d, &at.v[i]), wrap_v_);
      hn::Store(hn::Mul(bilinear(d, u, v, finest), hn::Set(d, scale_)), d, &result[i]);
    }
    return result;
  }

  // First for all vectors, so that none waits for another.
  std::array<Footprint<V>, K / kVector> footprints;
  for (std::size_t i = 0; i < K; i += kVector) footprints[i / kVector] = footprint(d, at, i);
  for (std::size_t i = 0; i < K; i += kVector) {
    if (skips(i)) continue;
    const Footprint<V>& f = footprints[i / kVector];
    const V at_u = hn::Load(d, &at.u[i]), at_v = hn::Load(d, &at.v[i]);
    const auto finer = to_integer(d, hn::Floor(f.lod));
    const auto coarser = hn::Min(hn::Add(finer, hn::Set(di, 1)), hn::Set(di, levels_ - 1));
    const V fraction = hn::Sub(f.lod, hn::Floor(f.lod));
    const bool blend = !hn::AllTrue(d, hn::Eq(fraction, zero));
    const auto fine = grid(d, finer), coarse = grid(d, coarser);

    const float max_probes = hn::GetLane(hn::MaxOfLanes(d, f.probes));
    V sum = zero;
    for (float probe = 0; probe < max_probes; ++probe) {
      const V offset = hn::Sub(hn::Mul(hn::Set(d, probe + 0.5F), f.per_probe), hn::Set(d, 0.5F));
      const V u = wrapped(d, hn::MulAdd(offset, f.step_u, at_u), wrap_u_);
      const V v = wrapped(d, hn::MulAdd(offset, f.step_v, at_v), wrap_v_);
      V value = bilinear(d, u, v, fine);
      if (blend) value = hn::MulAdd(fraction, hn::Sub(bilinear(d, u, v, coarse), value), value);
      sum = hn::MulAdd(hn::IfThenElseZero(hn::Lt(hn::Set(d, probe), f.probes), f.per_probe), value, sum);
    }
    hn::Store(hn::Mul(sum, hn::Set(d, scale_)), d, &result[i]);
  }
  return result;
}

/// Squares of the sides of the footprints of the lanes from i on, texels: rightwards and downwards.
template <class D, class Lookup>
auto Texture::sides2(D d, const Lookup& at, std::size_t i) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const auto squared_length = [&](const auto& du, const auto& dv) {
    const auto a = hn::Mul(hn::Load(d, &du[i]), hn::Set(d, level_width_[0]));
    const auto b = hn::Mul(hn::Load(d, &dv[i]), hn::Set(d, level_height_[0]));
    return hn::MulAdd(a, a, hn::Mul(b, b));
  };
  return std::pair(squared_length(at.du_dx, at.dv_dx), squared_length(at.du_dy, at.dv_dy));
}

template <class D, class Lookup>
auto Texture::largest_side2(D d, const Lookup& at, std::size_t i) const {
  const auto [x2, y2] = sides2(d, at, i);
  return hwy::HWY_NAMESPACE::Max(x2, y2);
}

/// For the lanes from i on: probes lie along the longer side, the shorter side sets the blur.
template <class D, class Lookup>
auto Texture::footprint(D d, const Lookup& at, std::size_t i) const {
  namespace hn = hwy::HWY_NAMESPACE;
  using V = hn::Vec<D>;
  const V one = hn::Set(d, 1.0F);
  const V du_dx = hn::Load(d, &at.du_dx[i]), dv_dx = hn::Load(d, &at.dv_dx[i]);
  const V du_dy = hn::Load(d, &at.du_dy[i]), dv_dy = hn::Load(d, &at.dv_dy[i]);
  const auto [x2, y2] = sides2(d, at, i);
  const auto along_x = hn::Ge(x2, y2);
  Footprint<V> f;
  f.step_u = hn::IfThenElse(along_x, du_dx, du_dy), f.step_v = hn::IfThenElse(along_x, dv_dx, dv_dy);

  // One texel is the finest resolution: there is one more probe if the longer side exceeds 1.25, 2.25 and 3.25 times
  // a texel and the shorter side. Squares avoid roots. The upper bound keeps a degenerate footprint (a pole, a horizon)
  // finite.
  static_assert(kMaxProbes == 4);
  const V major2 = hn::Min(hn::Max(x2, y2), hn::Set(d, 1e12F)), minor2 = hn::Max(hn::Min(x2, y2), one);
  const auto longer_than = [&](float times) { return hn::Gt(major2, hn::Mul(minor2, hn::Set(d, times * times))); };
  const auto two = longer_than(1.25F), three = longer_than(2.25F), four = longer_than(3.25F);
  const auto choose = [&](float for_two, float for_three, float for_four) {
    const V min = hn::IfThenElse(two, hn::Set(d, for_two), one);
    return hn::IfThenElse(four, hn::Set(d, for_four), hn::IfThenElse(three, hn::Set(d, for_three), min));
  };
  f.probes = choose(2, 3, 4), f.per_probe = choose(1.0F / 2, 1.0F / 3, 1.0F / 4);
  const V blur2 = hn::Max(hn::Mul(major2, hn::Mul(f.per_probe, f.per_probe)), minor2);
  const V lod = hn::Mul(binary_logarithm(d, blur2), hn::Set(d, 0.5F));
  f.lod = hn::Min(lod, hn::Set(d, static_cast<float>(levels_ - 1)));
  return f;
}

/// Converts integers from 0 to 2^22, which are the last bits of the number plus 2^23. A general conversion takes three
/// times as long.
template <class D, class V>
auto Texture::to_integer(D d, V x) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  return hn::And(hn::BitCast(di, hn::Add(x, hn::Set(d, 8388608.0F))), hn::Set(di, 0x007fffff));
}

/// fast_log2() of each lane.
template <class D, class V>
V Texture::binary_logarithm(D d, V x) {
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
auto Texture::grid(D d, I level) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  using AnyGrid = Grid<hn::Vec<D>, I>;
  // Neighbouring pixels usually sample the same level, and broadcasts are much cheaper than gathers.
  const std::int32_t first = hn::GetLane(level);
  if (hn::AllTrue(di, hn::Eq(level, hn::Set(di, first)))) {
    const auto i = static_cast<std::size_t>(first);
    return AnyGrid{hn::Set(d, level_width_[i]), hn::Set(d, level_height_[i]), hn::Set(di, level_offset_[i]),
                   hn::Set(di, level_stride_[i])};
  }
  return AnyGrid{hn::GatherIndex(d, level_width_.data(), level), hn::GatherIndex(d, level_height_.data(), level),
                 hn::GatherIndex(di, level_offset_.data(), level), hn::GatherIndex(di, level_stride_.data(), level)};
}

/// Maps any coordinate into the image, on [0, 1]; NaN becomes 0.
template <class D, class V>
V Texture::wrapped(D d, V coordinate, Wrap wrap) {
  namespace hn = hwy::HWY_NAMESPACE;
  if (wrap == Wrap::repeat) coordinate = hn::Sub(coordinate, hn::Floor(coordinate));
  return hn::Min(hn::Max(coordinate, hn::Zero(d)), hn::Set(d, 1.0F));
}

template <class D, class V, class I>
V Texture::bilinear(D d, V u, V v, const Grid<V, I>& on) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToUnsigned<D> du;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F);

  // Texel centres are at half-integers of the level's grid. `first` is the one before the coordinate; the next one
  // follows in memory, also at the end.
  const auto locate = [&](V unit, V size, Wrap wrap, V& first, V& fraction) {
    const V last = hn::Sub(size, one);
    V x = hn::MulSub(unit, size, half);
    if (wrap == Wrap::clamp) x = hn::Min(hn::Max(x, zero), last);
    first = hn::Floor(x);
    fraction = hn::Sub(x, first);
    first = hn::IfThenElse(hn::Lt(first, zero), last, first);
  };
  V x, y, fx, fy;
  locate(u, on.width, wrap_u_, x, fx);
  locate(v, on.height, wrap_v_, y, fy);
  const I column = to_integer(d, hn::Add(x, x));  // in bytes
  const I upper_row = hn::Add(hn::Add(on.offset, column), hn::Mul(to_integer(d, y), on.row_stride));
  const I lower_row = hn::Add(upper_row, on.row_stride);

  // One word contains two neighbouring texels.
  const auto bias = hn::Set(du, kCodeBias);
  const auto row = [&](I position) {
    const auto pair = hn::GatherOffset(du, reinterpret_cast<const std::uint32_t*>(codes_.data()), position);
    const auto left_code = hn::ShiftLeft<kCodeShift>(hn::And(pair, hn::Set(du, 0xffffU)));
    const auto right_code = hn::And(hn::ShiftRight<16 - kCodeShift>(pair), hn::Set(du, 0xffffU << kCodeShift));
    const V left = hn::BitCast(d, hn::Add(left_code, bias)), right = hn::BitCast(d, hn::Add(right_code, bias));
    return hn::MulAdd(fx, hn::Sub(right, left), left);
  };
  const V upper = row(upper_row), lower = row(lower_row);
  return hn::MulAdd(fy, hn::Sub(lower, upper), upper);
}

}  // namespace esim::inline scene
