#include "esim/scene/images/dead_leaves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "esim/core/random.h"

namespace esim::inline scene {
namespace {

/// One leaf: its shape in coordinates (p, q) that are 1 at its border, and its brightness.
struct Leaf {
  float x, y;                    // centre, px
  std::array<float, 4> to_unit;  // (p, q) = to_unit (pixel - centre)
  float reach;                   // px: pixels further away are outside
  bool rectangle;
  float log_light, gradient, stripes, frequency, phase;

  bool covers(float p, float q) const { return rectangle ? std::fabs(p) < 1 && std::fabs(q) < 1 : p * p + q * q < 1; }
  float light(float p, float q) const {
    float level = log_light + gradient * q;
    if (stripes > 0) level += stripes * std::sin(frequency * p + phase);
    return level;
  }
};

/// The radius that a fraction u of the leaves does not exceed, for the density 1 / r^3.
double radius(const DeadLeavesOptions& options, double u) {
  const double low = 1 / (options.min_radius_px * options.min_radius_px),
               high = 1 / (options.max_radius_px * options.max_radius_px);
  return 1 / std::sqrt(low + u * (high - low));
}

Leaf draw_leaf(const DeadLeavesOptions& options, const AddressedRandom& random, std::uint32_t number,
               std::uint64_t leaf) {
  const auto units = [&](std::uint64_t k) {
    std::array<double, 4> values{};
    const auto words = random.bits(number, leaf * 4 + k);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = (words[i] + 0.5) * 0x1.0p-32;
    return values;
  };
  const auto [size, across, down, turn] = units(0);
  const auto [aspect, shape, level, slope] = units(1);
  const auto [pattern, strength, frequency, phase] = units(2);

  const double r = radius(options, size), stretch = std::exp2(aspect - 0.5), angle = std::numbers::pi * turn;
  const double a = r * stretch, b = r / stretch, c = std::cos(angle), s = std::sin(angle);
  const bool rectangle = shape < 0.4;
  const double reach = std::max(a, b) * (rectangle ? std::numbers::sqrt2 : 1.0);
  const double dark = std::log(options.darkest), light = std::log(options.lightest);
  return {static_cast<float>(across * (options.width + 2 * reach) - reach),
          static_cast<float>(down * (options.height + 2 * reach) - reach),
          {static_cast<float>(c / a), static_cast<float>(s / a), static_cast<float>(-s / b), static_cast<float>(c / b)},
          static_cast<float>(reach),
          rectangle,
          static_cast<float>(dark + level * (light - dark)),
          static_cast<float>(0.6 * (slope - 0.5)),
          pattern < 0.25 ? static_cast<float>(0.3 * strength) : 0.0F,
          static_cast<float>(2 + frequency * 0.8 * a),  // at most one stripe in about eight pixels
          static_cast<float>(2 * std::numbers::pi * phase)};
}

/// Draws a leaf below all previous ones. Returns the number of pixels in which it is visible.
int lay_under(const Leaf& leaf, Image<float>& log_light, Image<std::uint8_t>& taken) {
  const int top = std::max(0, static_cast<int>(leaf.y - leaf.reach)),
            bottom = std::min(taken.height() - 1, static_cast<int>(leaf.y + leaf.reach) + 1);
  const int left = std::max(0, static_cast<int>(leaf.x - leaf.reach)),
            right = std::min(taken.width() - 1, static_cast<int>(leaf.x + leaf.reach) + 1);
  int seen = 0;
  for (int y = top; y <= bottom; ++y) {
    const float dy = static_cast<float>(y) - leaf.y;
    for (int x = left; x <= right; ++x) {
      if (taken(x, y) != 0) continue;
      const float dx = static_cast<float>(x) - leaf.x;
      const float p = leaf.to_unit[0] * dx + leaf.to_unit[1] * dy, q = leaf.to_unit[2] * dx + leaf.to_unit[3] * dy;
      if (!leaf.covers(p, q)) continue;
      log_light(x, y) = leaf.light(p, q);
      taken(x, y) = 1;
      ++seen;
    }
  }
  return seen;
}

}  // namespace

Image<float> dead_leaves(const DeadLeavesOptions& options, std::uint64_t seed, std::uint32_t number) {
  constexpr std::uint64_t kMaxLeaves = 100'000;
  constexpr std::int64_t kCovered = 200;  // one pixel in this number may show the background
  constexpr double kLens_px = 0.6;
  const AddressedRandom random(seed, Purpose::dead_leaves);
  const auto ground = static_cast<float>(0.5 * (std::log(options.darkest) + std::log(options.lightest)));
  Image<float> image(options.width, options.height, ground);
  Image<std::uint8_t> taken(options.width, options.height);
  auto left = static_cast<std::int64_t>(image.size());
  for (std::uint64_t leaf = 0; left > static_cast<std::int64_t>(image.size()) / kCovered && leaf < kMaxLeaves; ++leaf)
    left -= lay_under(draw_leaf(options, random, number, leaf), image, taken);

  const float low = static_cast<float>(options.darkest), high = static_cast<float>(options.lightest);
  for (float& value : image.pixels()) value = std::clamp(std::exp(value), low, high);
  cv::Mat pixels(image.height(), image.width(), CV_32F, image.data());
  cv::GaussianBlur(pixels, pixels, {0, 0}, kLens_px);
  return image;
}

}  // namespace esim::inline scene
