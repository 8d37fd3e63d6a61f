#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "esim/core/fast_log.h"
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
class Texture {
 public:
  Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v);

  /// Mean of the texture over each of the K footprints. Coordinates must be finite.
  template <int K>
  std::array<float, K> sample(const TextureLookup<K>& at) const;

  int width() const { return level_width_[0]; }
  int height() const { return level_height_[0]; }

 private:
  static constexpr int kMaxLevels = 18;
  static constexpr float kMaxProbes = 4;

  // Adds weight times the texture at (u, v), blurred to the level of detail lod.
  template <class D, class V>
  V trilinear(D d, V u, V v, V lod) const;
  template <class D, class V, class I>
  V bilinear(D d, V u, V v, I level) const;
  template <class D, class V, class I>
  static I texel_index(D d, V floor, I n, Wrap wrap);

  Wrap wrap_u_, wrap_v_;
  int levels_ = 0;
  std::array<int, kMaxLevels> level_offset_{}, level_width_{}, level_height_{};
  std::vector<float> texels_;  // all levels, each row-major
};

template <int K>
std::array<float, K> Texture::sample(const TextureLookup<K>& at) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::CappedTag<float, K> d;
  using V = hn::Vec<decltype(d)>;
  const V one = hn::Set(d, 1.0F), w = hn::Set(d, static_cast<float>(width())),
          h = hn::Set(d, static_cast<float>(height()));
  alignas(64) std::array<float, K> lod;
  alignas(64) std::array<float, K> result;

  for (std::size_t i = 0; i < K; i += hn::Lanes(d)) {
    // The footprint's sides in texels; probes go along the longer one, the shorter one sets the blur.
    const V du_dx = hn::Load(d, &at.du_dx[i]), dv_dx = hn::Load(d, &at.dv_dx[i]);
    const V du_dy = hn::Load(d, &at.du_dy[i]), dv_dy = hn::Load(d, &at.dv_dy[i]);
    const auto squared_length = [&](V du, V dv) {
      const V a = hn::Mul(du, w), b = hn::Mul(dv, h);
      return hn::MulAdd(a, a, hn::Mul(b, b));
    };
    const V x2 = squared_length(du_dx, dv_dx), y2 = squared_length(du_dy, dv_dy);
    const auto along_x = hn::Ge(x2, y2);
    // The upper bound keeps a degenerate footprint (a pole, a horizon) finite.
    const V major = hn::Min(hn::Sqrt(hn::IfThenElse(along_x, x2, y2)), hn::Set(d, 1e6F));
    const V minor = hn::Max(hn::Sqrt(hn::IfThenElse(along_x, y2, x2)), hn::Set(d, 1e-6F));
    const V ratio = hn::Min(major, hn::Div(major, minor));  // one texel is the finest that is resolved
    const V probes = hn::Min(hn::Max(hn::Ceil(hn::Sub(ratio, hn::Set(d, 0.25F))), one), hn::Set(d, kMaxProbes));
    const V per_probe = hn::Div(one, probes);
    hn::Store(hn::Max(hn::Max(hn::Mul(major, per_probe), minor), one), d, &lod[i]);
    for (std::size_t lane = i; lane < i + hn::Lanes(d); ++lane) {
      lod[lane] = std::min(fast_log2(lod[lane]), static_cast<float>(levels_ - 1));
    }

    const V step_u = hn::IfThenElse(along_x, du_dx, du_dy), step_v = hn::IfThenElse(along_x, dv_dx, dv_dy);
    const float most_probes = hn::GetLane(hn::MaxOfLanes(d, probes));
    V sum = hn::Zero(d);
    for (float probe = 0; probe < most_probes; ++probe) {
      const V offset = hn::Sub(hn::Mul(hn::Set(d, probe + 0.5F), per_probe), hn::Set(d, 0.5F));
      const V u = hn::MulAdd(offset, step_u, hn::Load(d, &at.u[i])),
              v = hn::MulAdd(offset, step_v, hn::Load(d, &at.v[i]));
      const V weight = hn::IfThenElseZero(hn::Lt(hn::Set(d, probe), probes), per_probe);
      sum = hn::MulAdd(weight, trilinear(d, u, v, hn::Load(d, &lod[i])), sum);
    }
    hn::Store(sum, d, &result[i]);
  }
  return result;
}

template <class D, class V>
V Texture::trilinear(D d, V u, V v, V lod) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const auto finer = hn::ConvertTo(di, lod);  // rounds towards zero
  const V fraction = hn::Sub(lod, hn::ConvertTo(d, finer));
  const V fine = bilinear(d, u, v, finer);
  if (hn::AllTrue(d, hn::Eq(fraction, hn::Zero(d)))) return fine;
  const auto coarser = hn::Min(hn::Add(finer, hn::Set(di, 1)), hn::Set(di, levels_ - 1));
  return hn::MulAdd(fraction, hn::Sub(bilinear(d, u, v, coarser), fine), fine);
}

template <class D, class V, class I>
V Texture::bilinear(D d, V u, V v, I level) const {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  const I n = hn::GatherIndex(di, level_width_.data(), level), m = hn::GatherIndex(di, level_height_.data(), level);
  const I offset = hn::GatherIndex(di, level_offset_.data(), level);

  // Texel centres are at half-integers of the level's grid.
  const auto on_grid = [&](V coordinate, I size, Wrap wrap) {
    const V unit = wrap == Wrap::repeat ? hn::Sub(coordinate, hn::Floor(coordinate))
                                        : hn::Min(hn::Max(coordinate, hn::Set(d, -1.0F)), hn::Set(d, 2.0F));
    return hn::MulSub(unit, hn::ConvertTo(d, size), hn::Set(d, 0.5F));
  };
  const V x = on_grid(u, n, wrap_u_), y = on_grid(v, m, wrap_v_);
  const V x_floor = hn::Floor(x), y_floor = hn::Floor(y);
  const V fx = hn::Sub(x, x_floor), fy = hn::Sub(y, y_floor);
  const V unit = hn::Set(d, 1.0F);
  const I x0 = texel_index(d, x_floor, n, wrap_u_), x1 = texel_index(d, hn::Add(x_floor, unit), n, wrap_u_);
  const I row0 = hn::Add(offset, hn::Mul(texel_index(d, y_floor, m, wrap_v_), n));
  const I row1 = hn::Add(offset, hn::Mul(texel_index(d, hn::Add(y_floor, unit), m, wrap_v_), n));

  const float* const texels = texels_.data();
  const V a = hn::GatherIndex(d, texels, hn::Add(row0, x0)), b = hn::GatherIndex(d, texels, hn::Add(row0, x1));
  const V c = hn::GatherIndex(d, texels, hn::Add(row1, x0)), e = hn::GatherIndex(d, texels, hn::Add(row1, x1));
  const V upper = hn::MulAdd(fx, hn::Sub(b, a), a), lower = hn::MulAdd(fx, hn::Sub(e, c), c);
  return hn::MulAdd(fy, hn::Sub(lower, upper), upper);
}

template <class D, class V, class I>
I Texture::texel_index(D d, V floor, I n, Wrap wrap) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> di;
  static_cast<void>(d);
  const I i = hn::ConvertTo(di, floor), last = hn::Sub(n, hn::Set(di, 1));
  if (wrap == Wrap::clamp) return hn::Min(hn::Max(i, hn::Zero(di)), last);
  const I not_negative = hn::IfThenElse(hn::Lt(i, hn::Zero(di)), hn::Add(i, n), i);
  return hn::IfThenElse(hn::Gt(not_negative, last), hn::Sub(not_negative, n), not_negative);
}

}  // namespace esim
