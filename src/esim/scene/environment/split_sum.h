#pragma once

#include <array>
#include <cstddef>

namespace esim::inline scene {

/// How much of uniform light a glossy surface reflects, by the cosine of the viewing angle and the roughness: with F0
/// at normal and F90 at grazing incidence, F0 scale + F90 offset (Karis, "Real shading in Unreal Engine 4", SIGGRAPH
/// 2013 course, with the height-correlated visibility of glTF 2.0). Within 2e-3 of the integral.
class SplitSum {
 public:
  struct Value {
    float scale, offset;
  };

  /// The table, which is computed at the first call.
  static const SplitSum& table();

  /// Interpolated; both arguments from 0 to 1.
  Value at(float cosine, float roughness) const {
    const float x = cosine * (kSize - 1), y = roughness * (kSize - 1);
    const auto column = static_cast<std::size_t>(x < kSize - 2 ? x : kSize - 2);
    const auto row = static_cast<std::size_t>(y < kSize - 2 ? y : kSize - 2);
    const float s = x - static_cast<float>(column), t = y - static_cast<float>(row);
    const Value *const upper = &values_[row * kSize + column], *const lower = upper + kSize;
    const auto mean = [&](float a, float b, float c, float d) {
      const float above = a + s * (b - a), below = c + s * (d - c);
      return above + t * (below - above);
    };
    return {mean(upper[0].scale, upper[1].scale, lower[0].scale, lower[1].scale),
            mean(upper[0].offset, upper[1].offset, lower[0].offset, lower[1].offset)};
  }

  static constexpr std::size_t kSize = 64;
  const std::array<Value, kSize * kSize>& values() const { return values_; }  ///< row by row: one row per roughness

 private:
  SplitSum();

  std::array<Value, kSize * kSize> values_;
};

}  // namespace esim::inline scene
