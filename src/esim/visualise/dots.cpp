#include "esim/visualise/dots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>

namespace esim {
namespace {

/// So many depths are told apart: neighbouring ones differ by less than can be seen.
constexpr std::size_t kDepths = 4096;

std::size_t depth_of(const Dot& dot) {
  const float nearness = dot.depth < 1.0f ? 1.0f - std::max(dot.depth, 0.0f) : 0.0f;  // the farthest first
  return static_cast<std::size_t>(nearness * static_cast<float>(kDepths - 1));
}

/// By counting, stable.
void sort(const std::vector<Dot>& dots, std::vector<Dot>& in_order) {
  std::vector<std::uint32_t> next(kDepths + 1);
  for (const Dot& dot : dots) ++next[depth_of(dot) + 1];
  for (std::size_t i = 0; i < kDepths; ++i) next[i + 1] += next[i];
  in_order.resize(dots.size());
  for (const Dot& dot : dots) in_order[next[depth_of(dot)]++] = dot;
}

/// How much of the pixels around it a dot covers.
struct Stamp {
  Tile area{};                           ///< of the pixels, relative to the one that the dot is in
  std::vector<std::uint16_t> covered{};  ///< 0 to 256, row by row
};

/// Of dots of one radius, for their places relative to the pixels in steps of 1/16.
class Stamps {
 public:
  static constexpr int kStepBits = 4, kSteps = 1 << kStepBits;

  explicit Stamps(float radius) {
    for (int y = 0; y < kSteps; ++y) {
      for (int x = 0; x < kSteps; ++x)
        all_.push_back(stamp(radius + 0.5f, static_cast<float>(x) / kSteps, static_cast<float>(y) / kSteps));
    }
  }

  /// Of a dot that is so many steps to the right of a pixel's centre, and below it.
  const Stamp& at(int x_steps, int y_steps) const { return all_[static_cast<std::size_t>(y_steps * kSteps + x_steps)]; }

 private:
  static Stamp stamp(float reach, float x, float y) {
    const int left = static_cast<int>(std::ceil(x - reach)), right = static_cast<int>(std::floor(x + reach));
    const int top = static_cast<int>(std::ceil(y - reach)), bottom = static_cast<int>(std::floor(y + reach));
    Stamp stamp{{left, top, right - left + 1, bottom - top + 1}};
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        const float distance = std::hypot(static_cast<float>(column) - x, static_cast<float>(row) - y);
        stamp.covered.push_back(static_cast<std::uint16_t>(256 * std::clamp(reach - distance, 0.0f, 1.0f) + 0.5f));
      }
    }
    return stamp;
  }

  std::vector<Stamp> all_;
};

/// Those of radii in steps of 1/8 px, each made when it is first asked for.
const Stamps& stamps_of(float radius) {
  constexpr float kSteps = 8;
  constexpr std::size_t kMost = 256;
  thread_local std::array<std::unique_ptr<Stamps>, kMost> all;
  const auto index = static_cast<std::size_t>(std::clamp(radius * kSteps + 0.5f, 1.0f, kMost - 1.0f));
  if (all[index] == nullptr) all[index] = std::make_unique<Stamps>(static_cast<float>(index) / kSteps);
  return *all[index];
}

/// Pixels of four bytes, so that red and blue are blended by one multiplication.
struct Wide {
  static constexpr std::uint32_t kRedAndBlue = 0xff00ff, kGreen = 0xff00;

  static std::uint32_t of(Rgb colour) {
    return std::uint32_t{colour.r} | std::uint32_t{colour.g} << 8 | std::uint32_t{colour.b} << 16;
  }
  static Rgb narrow(std::uint32_t pixel) {
    return {static_cast<std::uint8_t>(pixel), static_cast<std::uint8_t>(pixel >> 8),
            static_cast<std::uint8_t>(pixel >> 16)};
  }
  /// `amount` of 256 parts of `to`.
  static std::uint32_t blend(std::uint32_t from, std::uint32_t to, std::uint32_t amount) {
    const std::uint32_t rest = 256 - amount;
    const std::uint32_t red_and_blue = (from & kRedAndBlue) * rest + (to & kRedAndBlue) * amount + 0x800080;
    const std::uint32_t green = (from & kGreen) * rest + (to & kGreen) * amount + 0x8000;
    return (red_and_blue >> 8 & kRedAndBlue) | (green >> 8 & kGreen);
  }
};

void draw_dot(const Dot& dot, Image<std::uint32_t>& picture) {
  const int x = static_cast<int>(std::floor(dot.x * Stamps::kSteps + 0.5f));
  const int y = static_cast<int>(std::floor(dot.y * Stamps::kSteps + 0.5f));
  const Stamp& stamp = stamps_of(dot.radius).at(x & (Stamps::kSteps - 1), y & (Stamps::kSteps - 1));
  const auto& [area_x, area_y, width, height] = stamp.area;
  const int left = (x >> Stamps::kStepBits) + area_x, top = (y >> Stamps::kStepBits) + area_y;
  const int first_column = std::max(0, -left), last_column = std::min(width, picture.width() - left);
  const int first_row = std::max(0, -top), last_row = std::min(height, picture.height() - top);
  const std::uint32_t colour = Wide::of(dot.colour), opacity = dot.opacity;
  for (int row = first_row; row < last_row; ++row) {
    std::uint32_t* const pixels = picture.row(top + row);
    const std::uint16_t* const covered = stamp.covered.data() + row * width;
    for (int column = first_column; column < last_column; ++column) {
      const std::uint32_t amount = (opacity * covered[column] + 128) >> 8;
      pixels[left + column] = Wide::blend(pixels[left + column], colour, amount);
    }
  }
}

}  // namespace

void draw_dots(const std::vector<Dot>& dots, Image<Rgb>& picture) {
  thread_local std::vector<Dot> in_order;
  sort(dots, in_order);
  Image<std::uint32_t> wide(picture.width(), picture.height());
  std::transform(picture.pixels().begin(), picture.pixels().end(), wide.pixels().begin(), Wide::of);
  constexpr float kMostPlace = 1e6f;
  for (const Dot& dot : in_order) {
    if (std::abs(dot.x) < kMostPlace && std::abs(dot.y) < kMostPlace) draw_dot(dot, wide);
  }
  std::transform(wide.pixels().begin(), wide.pixels().end(), picture.pixels().begin(), Wide::narrow);
}

}  // namespace esim
