#include "esim/core/colour/srgb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

namespace esim::inline core {
namespace {

double linear_from_srgb(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

// Irradiance at which level i + 1 becomes nearer than level i.
std::array<float, 255> level_bounds() {
  std::array<float, 255> bounds;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    bounds[i] = static_cast<float>(linear_from_srgb((static_cast<double>(i) + 0.5) / 255.0));
  }
  return bounds;
}

// A table with one entry for all floats on [2^-13, 1) with the same first kCodeBits of mantissa. These intervals are so
// short that each contains at most one bound. Smaller numbers have level 0.
constexpr int kCodeBits = 9, kOctaves = 13;
constexpr std::uint32_t kFirstCode = (127U - kOctaves) << kCodeBits;
std::uint32_t code_of(float e) { return std::bit_cast<std::uint32_t>(e) >> (23 - kCodeBits); }

// Level at the start of each interval.
std::array<std::uint8_t, std::size_t{kOctaves} << kCodeBits> level_starts(const std::array<float, 255>& bounds) {
  std::array<std::uint8_t, std::size_t{kOctaves} << kCodeBits> starts;
  for (std::uint32_t i = 0; i < starts.size(); ++i) {
    const auto start = std::bit_cast<float>((kFirstCode + i) << (23 - kCodeBits));
    starts[i] = static_cast<std::uint8_t>(std::upper_bound(bounds.begin(), bounds.end(), start) - bounds.begin());
  }
  return starts;
}

}  // namespace

Image<std::uint8_t> encode_srgb(const Image<float>& irradiance) {
  static const auto kBounds = level_bounds();
  static const auto kStarts = level_starts(kBounds);
  Image<std::uint8_t> encoded(irradiance.width(), irradiance.height());
  std::transform(irradiance.pixels().begin(), irradiance.pixels().end(), encoded.pixels().begin(), [](float e) {
    if (!(e >= kBounds.front())) return std::uint8_t{0};
    if (e >= kBounds.back()) return std::uint8_t{255};
    const std::uint8_t start = kStarts[code_of(e) - kFirstCode];
    return static_cast<std::uint8_t>(start + (e >= kBounds[start]));
  });
  return encoded;
}

Image<float> decode_srgb(const Image<std::uint16_t>& encoded, int bits) {
  const double full_scale = static_cast<double>((1 << bits) - 1);
  std::vector<float> levels(std::size_t{1} << bits);
  for (std::size_t i = 0; i < levels.size(); ++i)
    levels[i] = static_cast<float>(linear_from_srgb(static_cast<double>(i) / full_scale));
  Image<float> irradiance(encoded.width(), encoded.height());
  std::transform(encoded.pixels().begin(), encoded.pixels().end(), irradiance.pixels().begin(),
                 [&](std::uint16_t level) { return levels[level]; });
  return irradiance;
}

}  // namespace esim::inline core
