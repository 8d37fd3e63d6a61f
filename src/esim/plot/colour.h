#pragma once

#include <cstdint>

namespace esim::inline plot {

struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};

/// Blends two colours: `amount` (0 to 1) of the second.
inline Rgb mix(Rgb from, Rgb to, float amount) {
  const auto blend = [amount](std::uint8_t a, std::uint8_t b) {
    const float value = static_cast<float>(a) + amount * static_cast<float>(b - a);
    return static_cast<std::uint8_t>((value < 0.0f ? 0.0f : value > 255.0f ? 255.0f : value) + 0.5f);
  };
  return {blend(from.r, to.r), blend(from.g, to.g), blend(from.b, to.b)};
}

}  // namespace esim::inline plot
