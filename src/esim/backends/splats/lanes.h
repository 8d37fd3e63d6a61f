#pragma once

#include <hwy/highway.h>

// Private to backends/splats: includes hwy/highway.h.
namespace esim::inline backends::inline splats {

namespace hn = hwy::HWY_NAMESPACE;

/// Pixels, or splats, that are computed side by side: at most 8.
using LanesTag = hn::CappedTag<float, 8>;
using Lanes = hn::Vec<LanesTag>;
inline constexpr LanesTag kTag;
inline constexpr int kLanes = static_cast<int>(hn::MaxLanes(LanesTag()));

HWY_INLINE Lanes all(float value) { return hn::Set(kTag, value); }

/// 2^x within 3e-7 of its value, for x from -126 to 126: Taylor's series on [-0.5, 0.5].
HWY_INLINE Lanes exp2_of(Lanes x) {
  const Lanes rounded = hn::Round(x), f = hn::Sub(x, rounded);
  Lanes p = all(1.5403530e-4F);
  p = hn::MulAdd(p, f, all(1.3333558e-3F));
  p = hn::MulAdd(p, f, all(9.6181291e-3F));
  p = hn::MulAdd(p, f, all(5.5504109e-2F));
  p = hn::MulAdd(p, f, all(2.4022651e-1F));
  p = hn::MulAdd(p, f, all(6.9314718e-1F));
  p = hn::MulAdd(p, f, all(1.0F));
  const auto exponent = hn::ShiftLeft<23>(hn::ConvertTo(hn::RebindToSigned<LanesTag>(), rounded));
  return hn::BitCast(kTag, hn::Add(hn::BitCast(hn::RebindToSigned<LanesTag>(), p), exponent));
}

/// log2(x) for x > 0, normal and finite: as core/fast_log.h.
HWY_INLINE Lanes log2_of(Lanes x) {
  const hn::RebindToSigned<LanesTag> integers;
  const auto bits = hn::BitCast(integers, x);
  const auto exponent = hn::Sub(hn::ShiftRight<23>(bits), hn::Set(integers, 127));
  const auto mantissa = hn::Or(hn::And(bits, hn::Set(integers, 0x007fffff)), hn::Set(integers, 0x3f800000));
  const Lanes m = hn::Sub(hn::BitCast(kTag, mantissa), all(1));
  Lanes q = all(0.02584142F);
  for (const float c : {-0.0959564F, 0.18194884F, -0.2756003F, 0.44254494F}) q = hn::MulAdd(q, m, all(c));
  return hn::Add(hn::ConvertTo(kTag, exponent), hn::MulAdd(hn::Mul(m, hn::Sub(all(1), m)), q, m));
}

}  // namespace esim::inline backends::inline splats
