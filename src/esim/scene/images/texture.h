#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/scene/images/box_filter.h"

namespace cv {
class Mat;
}

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

/// A linear-light image that can be averaged over a pixel's footprint, a parallelogram. Between its texels, the image
/// is interpolated bilinearly; docs/methods/rendering.md has the filter and its accuracy.
///
/// A pyramid holds the image at resolutions that decrease by sqrt(2). On one of its levels, the filter has 4 x 4 taps,
/// with the widths of the footprint along u and v; a long or slanted footprint takes several such probes along its
/// longer side. All weights are >= 0, so that nothing rings around bright light.
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
  static constexpr int kMaxLevels = 36;
  static constexpr int kMaxProbes = 8;

  // Texels that continue a level beyond its edges: as far as any tap reaches.
  static constexpr int kBefore = 3, kAfter = 4;

  // A code is the upper 16 bits of value / scale_ as a float, without those that are the same in all: see encode().
  static constexpr int kCodeShift = 12;
  static constexpr std::uint32_t kCodeBias = 96U << 23;

  // Footprints are measured by squares of widths, in texels: 12 times the variance, that is w^2 for a box of width w.
  // A footprint of the square width kWidestBox2 or more is filtered on a coarser level.
  static constexpr float kBlend = 0.1F;     // the part of the range of a level in which it is blended with the next
  static constexpr float kFirstLevel2 = 9;  // below the square widths of that part, on the first level
  static constexpr float kReduction2 = 2;   // of the second level

  /// The mip levels that the lanes of a vector sample.
  template <class V, class I>
  struct Grid {
    V width, height;               // texels
    V squared_u, squared_v, blur;  // squares of its width and height over those of level 0; see level_blur_
    I offset, row_stride;          // bytes
  };

  /// The second moments of footprints, times 12, in square texels of level 0.
  template <class V>
  struct Moments {
    V uu, uv, vv;
  };

  /// The footprints of pixels on the texture.
  template <class V>
  struct Footprint {
    V width2_u, width2_v;  // square widths of a probe, in texels of level 0
    V step_u, step_v;      // from one probe to the next
    V probes, per_probe;   // 1 / probes
    V lod;                 // level of the pyramid
  };

  template <class V>
  struct TwoOf {
    V first, second;
  };

  void append(const cv::Mat& level);
  cv::Mat reduced(const cv::Mat& image) const;
  std::uint16_t encode(float value) const;
  template <class D, class Lookup>
  auto moments(D d, const Lookup& at, std::size_t i) const;
  template <class D, class V>
  Footprint<V> footprint(D d, const Moments<V>& moments) const;
  template <class D, class I>
  auto grid(D d, I level) const;
  template <class D, class V>
  static V binary_logarithm(D d, V x);
  template <class D, class V>
  static auto to_integer(D d, V x);
  template <class D, class V>
  V interpolated(D d, V u, V v) const;
  template <class D, class V, class I>
  V mean(D d, const Footprint<V>& footprint, V u, V v, const Grid<V, I>& on) const;
  template <class D, class W>
  static auto decoded(D d, W words);
  template <class D, class I>
  auto two_texels(D d, I position) const;
  template <class D>
  auto words(D d, const std::int32_t* bytes) const;
  template <class D, class I>
  auto four_texels(D d, I position) const;
  template <class D, class V>
  static void locate(D d, V coordinate, V size, Wrap wrap, V& first, V& t);

  Wrap wrap_u_, wrap_v_;
  int levels_ = 0;
  float scale_ = 1;
  std::array<float, kMaxLevels> level_width_{}, level_height_{}, level_squared_u_{}, level_squared_v_{};
  std::array<float, kMaxLevels> level_blur_{};  // what the square width of the taps leaves to the level's texels
  std::array<std::int32_t, kMaxLevels> level_offset_{}, level_stride_{};  // bytes
  LargeVector<std::uint16_t> codes_;  // all levels, row-major, with their continuations
};

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

#if HWY_TARGET == HWY_SCALAR
/// For programs that include this header and are compiled without vectors.
template <class D, class I>
HWY_INLINE auto Texture::four_texels(D d, I position) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const auto [first, second] = two_texels(d, position);
  const auto [third, fourth] = two_texels(d, hn::Add(position, hn::Set(hn::RebindToSigned<D>(), 4)));
  return FourOf<hn::Vec<D>>{first, second, third, fourth};
}
#else
/// The words at bytes of codes_. Single loads are faster than gathering words of this size.
template <class D>
HWY_INLINE auto Texture::words(D d, const std::int32_t* bytes) const {
  namespace hn = hwy::HWY_NAMESPACE;
  if constexpr (hn::MaxLanes(D()) == 1) {
    const auto* const from = reinterpret_cast<const char*>(codes_.data()) + *bytes;
    return hn::LoadU(d, reinterpret_cast<const hn::TFromD<D>*>(from));
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, words(half, bytes + hn::MaxLanes(half)), words(half, bytes));
  }
}

/// Four neighbouring texels of a row, from a byte of codes_ on.
template <class D, class I>
HWY_INLINE auto Texture::four_texels(D d, I position) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToUnsigned<D> du;
  const hn::Repartition<std::uint64_t, D> du64;
  constexpr std::size_t kLanes = hn::MaxLanes(D());
  alignas(64) std::array<std::int32_t, kLanes> bytes;
  hn::Store(position, hn::RebindToSigned<D>(), bytes.data());
  const auto lower = hn::BitCast(du, words(du64, &bytes[0])), upper = hn::BitCast(du, words(du64, &bytes[kLanes / 2]));
  const auto [first, second] = decoded(d, hn::ConcatEven(du, upper, lower));
  const auto [third, fourth] = decoded(d, hn::ConcatOdd(du, upper, lower));
  return FourOf<hn::Vec<D>>{first, second, third, fourth};
}
#endif

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
  const auto stride = hn::Set(di, level_stride_[0]);
  // After the first of four taps, and one row below.
  const auto position = hn::Add(hn::Add(to_integer(d, hn::Add(column, column)), hn::Set(di, 2)),
                                hn::Mul(hn::Add(to_integer(d, row), hn::Set(di, 1)), stride));
  const auto mean_of_row = [&](auto at) {
    const auto [first, second] = two_texels(d, at);
    return hn::MulAdd(right, second, hn::Mul(left, first));
  };
  return hn::MulAdd(below, mean_of_row(hn::Add(position, stride)), hn::Mul(above, mean_of_row(position)));
}

template <class D, class V, class I>
HWY_INLINE V Texture::mean(D d, const Footprint<V>& f, V u, V v, const Grid<V, I>& on) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const BoxFilter<D> filter_u(d, hn::Mul(f.width2_u, on.squared_u), on.blur);
  const BoxFilter<D> filter_v(d, hn::Mul(f.width2_v, on.squared_v), on.blur);

  const auto probe_at = [&](V at_u, V at_v) {
    V column, row, t_u, t_v;
    locate(d, at_u, on.width, wrap_u_, column, t_u);
    locate(d, at_v, on.height, wrap_v_, row, t_v);
    const FourOf<V> across = filter_u.weights(t_u), down = filter_v.weights(t_v);
    const I first =
        hn::Add(hn::Add(on.offset, to_integer(d, hn::Add(column, column))), hn::Mul(to_integer(d, row), on.row_stride));
    const auto mean_of_row = [&](I position) {
      const FourOf<V> texels = four_texels(d, position);
      const V middle = hn::MulAdd(across.third, texels.third, hn::Mul(across.second, texels.second));
      return hn::MulAdd(across.fourth, texels.fourth, hn::MulAdd(across.first, texels.first, middle));
    };
    const I second = hn::Add(first, on.row_stride), third = hn::Add(second, on.row_stride);
    const V middle = hn::MulAdd(down.third, mean_of_row(third), hn::Mul(down.second, mean_of_row(second)));
    return hn::MulAdd(down.fourth, mean_of_row(hn::Add(third, on.row_stride)),
                      hn::MulAdd(down.first, mean_of_row(first), middle));
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
