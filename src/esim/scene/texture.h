#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "esim/core/image.h"

namespace esim {

/// What lies beyond the edge of a texture.
enum class Wrap { repeat, clamp };

/// Where K pixels look at a texture, and how large their footprints are there. Texture coordinates: u to the right,
/// v downwards, the image spans [0, 1] x [0, 1]. One array per quantity, for SIMD code; K is 4 or a multiple of 8.
template <int K>
struct TextureLookup {
  alignas(64) std::array<float, K> u, v;
  alignas(64) std::array<float, K> du_dx, dv_dx;  // change of (u, v) over one pixel to the right
  alignas(64) std::array<float, K> du_dy, dv_dy;  // change of (u, v) over one pixel downwards
};

/// A linear-light image that can be averaged over a pixel's footprint: a mip pyramid, sampled trilinearly at up to
/// kMaxProbes places along the footprint's longer side, so that neither distance nor a grazing view aliases.
///
/// Rendering waits for memory, so a texel is kept in 16 bits: a floating-point number without sign, of 11 bits of
/// mantissa, relative to the brightest texel. Its relative error is at most 2^-12, far below that of 8-bit images, down
/// to 2^-31 of the brightest; what is darker counts as that. Light that is negative or no number counts as none.
class Texture {
 public:
  Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v);

  /// Mean of the texture over each of the K footprints. Lanes whose bit in `lanes` is not set need no value.
  template <int K>
  std::array<float, K> sample(const TextureLookup<K>& at, std::uint32_t lanes = ~0U) const;

  int width() const { return static_cast<int>(level_width_[0]); }
  int height() const { return static_cast<int>(level_height_[0]); }

  Wrap wrap_u() const { return wrap_u_; }
  Wrap wrap_v() const { return wrap_v_; }

  /// The texels as they are kept, at full resolution.
  Image<float> texels() const;

 private:
  static constexpr int kMaxLevels = 18;
  static constexpr float kMaxProbes = 4;

  // A code is the upper 16 bits of value / scale_ as a float, less those that are the same in all: see encode().
  static constexpr int kCodeShift = 12;
  static constexpr std::uint32_t kCodeBias = 96U << 23;

  /// The levels that the lanes of a vector look at.
  template <class V, class I>
  struct Grid {
    V width, height;       // texels
    I offset, row_stride;  // bytes
  };

  std::uint16_t encode(float value) const;
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
  std::vector<std::uint16_t> codes_;  // all levels, row-major; each row and column ends with what lies beyond it
};

template <int K>
std::array<float, K> Texture::sample(const TextureLookup<K>& at, std::uint32_t lanes) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<float, K> d;
  using V = hn::Vec<decltype(d)>;
  constexpr std::size_t kVector = hn::MaxLanes(decltype(d)());
  const hn::RebindToSigned<decltype(d)> di;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  const V w = hn::Set(d, level_width_[0]), h = hn::Set(d, level_height_[0]);
  alignas(64) std::array<float, K> result;

  for (std::size_t i = 0; i < K; i += kVector) {
    if ((lanes >> i & ((std::uint64_t{1} << kVector) - 1)) == 0) continue;

    // The footprint's sides in texels; probes go along the longer one, the shorter one sets the blur.
    const V du_dx = hn::Load(d, &at.du_dx[i]), dv_dx = hn::Load(d, &at.dv_dx[i]);
    const V du_dy = hn::Load(d, &at.du_dy[i]), dv_dy = hn::Load(d, &at.dv_dy[i]);
    const auto squared_length = [&](V du, V dv) {
      const V a = hn::Mul(du, w), b = hn::Mul(dv, h);
      return hn::MulAdd(a, a, hn::Mul(b, b));
    };
    const V x2 = squared_length(du_dx, dv_dx), y2 = squared_length(du_dy, dv_dy);
    if (hn::AllTrue(d, hn::Le(hn::Max(x2, y2), one))) {
      // Seen from close by: footprints within a texel, where the rest comes to the same.
      const V u = wrapped(d, hn::Load(d, &at.u[i]), wrap_u_), v = wrapped(d, hn::Load(d, &at.v[i]), wrap_v_);
      hn::Store(hn::Mul(bilinear(d, u, v, grid(d, hn::Zero(di))), hn::Set(d, scale_)), d, &result[i]);
      continue;
    }
    const auto along_x = hn::Ge(x2, y2);
    // Squared, which spares roots. The upper bound keeps a degenerate footprint (a pole, a horizon) finite.
    const V major2 = hn::Min(hn::IfThenElse(along_x, x2, y2), hn::Set(d, 1e12F));
    const V minor2 = hn::Max(hn::IfThenElse(along_x, y2, x2), hn::Set(d, 1e-12F));
    const V ratio = hn::Sqrt(hn::Min(major2, hn::Div(major2, minor2)));  // one texel is the finest that is resolved
    const V probes = hn::Min(hn::Max(hn::Ceil(hn::Sub(ratio, hn::Set(d, 0.25F))), one), hn::Set(d, kMaxProbes));
    const V per_probe = hn::Div(one, probes);

    // The two levels on either side of the blur.
    const V blur2 = hn::Max(hn::Max(hn::Mul(major2, hn::Mul(per_probe, per_probe)), minor2), one);
    const V lod =
        hn::Min(hn::Mul(binary_logarithm(d, blur2), hn::Set(d, 0.5F)), hn::Set(d, static_cast<float>(levels_ - 1)));
    const auto finer = to_integer(d, hn::Floor(lod));
    const auto coarser = hn::Min(hn::Add(finer, hn::Set(di, 1)), hn::Set(di, levels_ - 1));
    const V fraction = hn::Sub(lod, hn::ConvertTo(d, finer));
    const bool blend = !hn::AllTrue(d, hn::Eq(fraction, zero));
    const auto fine = grid(d, finer), coarse = grid(d, coarser);

    const V step_u = hn::IfThenElse(along_x, du_dx, du_dy), step_v = hn::IfThenElse(along_x, dv_dx, dv_dy);
    const float most_probes = hn::GetLane(hn::MaxOfLanes(d, probes));
    V sum = zero;
    for (float probe = 0; probe < most_probes; ++probe) {
      const V offset = hn::Sub(hn::Mul(hn::Set(d, probe + 0.5F), per_probe), hn::Set(d, 0.5F));
      const V u = wrapped(d, hn::MulAdd(offset, step_u, hn::Load(d, &at.u[i])), wrap_u_);
      const V v = wrapped(d, hn::MulAdd(offset, step_v, hn::Load(d, &at.v[i])), wrap_v_);
      V value = bilinear(d, u, v, fine);
      if (blend) value = hn::MulAdd(fraction, hn::Sub(bilinear(d, u, v, coarse), value), value);
      sum = hn::MulAdd(hn::IfThenElseZero(hn::Lt(hn::Set(d, probe), probes), per_probe), value, sum);
    }
    hn::Store(hn::Mul(sum, hn::Set(d, scale_)), d, &result[i]);
  }
  return result;
}

/// Of whole numbers from 0 to 2^22: those are the last bits of what is 2^23 larger. A general conversion takes thrice
/// as long.
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
  // Neighbouring pixels mostly look at the same level, and broadcasts are far cheaper than gathers.
  const std::int32_t first = hn::GetLane(level);
  if (hn::AllTrue(di, hn::Eq(level, hn::Set(di, first)))) {
    const auto i = static_cast<std::size_t>(first);
    return AnyGrid{hn::Set(d, level_width_[i]), hn::Set(d, level_height_[i]), hn::Set(di, level_offset_[i]),
                   hn::Set(di, level_stride_[i])};
  }
  return AnyGrid{hn::GatherIndex(d, level_width_.data(), level), hn::GatherIndex(d, level_height_.data(), level),
                 hn::GatherIndex(di, level_offset_.data(), level), hn::GatherIndex(di, level_stride_.data(), level)};
}

/// The coordinate within the image, on [0, 1] whatever it was: what is no number becomes 0.
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

  // Texel centres are at half-integers of the level's grid. `first` is the one before the coordinate; the one after it
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

  // Two neighbouring texels come in one word.
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

}  // namespace esim
