#pragma once

#include <bit>
#include <cstdint>

namespace esim::inline core {

/// Binary logarithm within 3e-6 plus the rounding of a float, for x > 0, normal and finite. Monotone, continuous, exact
/// at powers of two, and built from operations that compile to SIMD code. Use it for decisions (a level of detail, a
/// sampling interval), not for signals.
inline float fast_log2(float x) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  const float exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  const float m = std::bit_cast<float>((bits & 0x007fffffU) | 0x3f800000U) - 1.0F;  // on [0, 1)

  // log2(1 + m) = m + m (1 - m) q(m), with q the minimax polynomial of degree 4.
  const float q = 0.44254494F + m * (-0.2756003F + m * (0.18194884F + m * (-0.0959564F + m * 0.02584142F)));
  return exponent + m + m * (1.0F - m) * q;
}

/// Natural logarithm, likewise.
inline float fast_log(float x) { return 0.6931471806F * fast_log2(x); }

}  // namespace esim::inline core
