#pragma once

namespace esim::inline core {

/// Arc tangent of t on [0, 1], within 3e-7: the polynomial of Abramowitz and Stegun, 4.4.49, from operations that
/// compile to SIMD code.
inline float fast_arc_tangent(float t) {
  const float s = t * t;
  float angle = 0.0028662257F;
  angle = angle * s - 0.0161657367F;
  angle = angle * s + 0.0429096138F;
  angle = angle * s - 0.0752896400F;
  angle = angle * s + 0.1065626393F;
  angle = angle * s - 0.1420889944F;
  angle = angle * s + 0.1999355085F;
  angle = angle * s - 0.3333314528F;
  return (angle * s + 1.0F) * t;
}

}  // namespace esim::inline core
