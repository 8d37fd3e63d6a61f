#pragma once

#include <array>
#include <cstddef>

#include "esim/backends/splats/lanes.h"
#include "esim/backends/splats/splat_scene.h"

// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

/// The colours of the splats i, i + 1, ... of a group, seen along `direction` (any length): max(0, 0.5 + Σ_k c_k Y_k),
/// with the real spherical harmonics in the order and with the signs of 3D Gaussian splatting.
HWY_INLINE std::array<Lanes, 3> colours_of(const SplatGroup& group, std::size_t i,
                                           const std::array<Lanes, 3>& direction) {
  std::array<Lanes, 3> colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = hn::LoadU(kTag, &group.colour[c][i]);
  if (group.degree > 0) {
    const hn::Rebind<hwy::float16_t, LanesTag> half_tag;
    const hn::Rebind<std::uint16_t, LanesTag> bits_tag;
    const auto add = [&](std::size_t k, Lanes basis) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto bits = hn::LoadU(bits_tag, group.harmonic(k, c) + i);
        colour[c] = hn::MulAdd(hn::PromoteTo(kTag, hn::BitCast(half_tag, bits)), basis, colour[c]);
      }
    };
    const auto times = [](float factor, Lanes a) { return hn::Mul(all(factor), a); };
    const Lanes length2 = hn::MulAdd(direction[0], direction[0],
                                     hn::MulAdd(direction[1], direction[1], hn::Mul(direction[2], direction[2])));
    const Lanes per_length = hn::Div(all(1), hn::Sqrt(hn::Max(length2, all(1e-30F))));
    const Lanes x = hn::Mul(direction[0], per_length), y = hn::Mul(direction[1], per_length);
    const Lanes z = hn::Mul(direction[2], per_length);
    add(1, times(-0.4886025119F, y)), add(2, times(0.4886025119F, z)), add(3, times(-0.4886025119F, x));
    if (group.degree > 1) {
      const Lanes xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z);
      const Lanes xy = hn::Mul(x, y), yz = hn::Mul(y, z), xz = hn::Mul(x, z);
      add(4, times(1.0925484306F, xy)), add(5, times(-1.0925484306F, yz));
      add(6, times(0.3153915653F, hn::Sub(hn::Add(zz, zz), hn::Add(xx, yy))));
      add(7, times(-1.0925484306F, xz)), add(8, times(0.5462742153F, hn::Sub(xx, yy)));
      if (group.degree > 2) {
        const Lanes three_xx_yy = hn::MulSub(all(3), xx, yy), xx_three_yy = hn::NegMulAdd(all(3), yy, xx);
        const Lanes four_zz = hn::Sub(hn::MulSub(all(4), zz, xx), yy);
        const Lanes two_zz = hn::NegMulAdd(all(3), hn::Add(xx, yy), hn::Add(zz, zz));
        add(9, times(-0.5900435899F, hn::Mul(y, three_xx_yy))), add(10, times(2.8906114426F, hn::Mul(xy, z)));
        add(11, times(-0.4570457995F, hn::Mul(y, four_zz))), add(12, times(0.3731763326F, hn::Mul(z, two_zz)));
        add(13, times(-0.4570457995F, hn::Mul(x, four_zz))), add(14, times(1.4453057213F, hn::Mul(z, hn::Sub(xx, yy))));
        add(15, times(-0.5900435899F, hn::Mul(x, xx_three_yy)));
      }
    }
  }
  for (Lanes& value : colour) value = hn::Max(value, hn::Zero(kTag));
  return colour;
}

}  // namespace esim::inline backends::inline splats
