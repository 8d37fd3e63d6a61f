#include "esim/visualise/dots.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <memory>

namespace esim::inline visualise {
namespace {

/// Number of distinct depths: neighbouring ones look the same.
constexpr std::size_t kDepths = 4096;

std::size_t depth_of(const Dot& dot) {
  const float nearness = dot.depth < 1.0f ? 1.0f - std::max(dot.depth, 0.0f) : 0.0f;  // farthest first
  return static_cast<std::size_t>(nearness * static_cast<float>(kDepths - 1));
}

/// Stable counting sort by depth.
void sort(const std::vector<Dot>& dots, std::vector<Dot>& in_order) {
  std::vector<std::uint32_t> next(kDepths + 1);
  for (const Dot& dot : dots) ++next[depth_of(dot) + 1];
  for (std::size_t i = 0; i < kDepths; ++i) next[i + 1] += next[i];
  in_order.resize(dots.size());
  for (const Dot& dot : dots) in_order[next[depth_of(dot)]++] = dot;
}

constexpr int kTogether = 4;  // pixels of four bytes each that are blended together
using Bytes = std::uint8_t __attribute__((vector_size(4 * kTogether)));
using Lanes = std::uint16_t __attribute__((vector_size(8 * kTogether)));

/// Coverage of the pixels around a dot, 0 to 255: rows of groups of pixels.
struct Stamp {
  int left = 0, top = 0;  ///< of the first group, relative to the dot's pixel
  int groups = 0, rows = 0;
  std::vector<Lanes> covered{};
};

/// Stamps of dots of one radius, for positions within a pixel in steps of 1/16.
class Stamps {
 public:
  static constexpr int kStepBits = 4, kSteps = 1 << kStepBits;

  explicit Stamps(float radius) {
    for (int y = 0; y < kSteps; ++y) {
      for (int x = 0; x < kSteps; ++x)
        all_.push_back(stamp(radius + 0.5f, static_cast<float>(x) / kSteps, static_cast<float>(y) / kSteps));
    }
  }

  /// The stamp of a dot at x_steps to the right of a pixel's centre and y_steps below it.
  const Stamp& at(int x_steps, int y_steps) const { return all_[static_cast<std::size_t>(y_steps * kSteps + x_steps)]; }

 private:
  static Stamp stamp(float reach, float x, float y) {
    const int left = static_cast<int>(std::ceil(x - reach)), right = static_cast<int>(std::floor(x + reach));
    const int top = static_cast<int>(std::ceil(y - reach)), bottom = static_cast<int>(std::floor(y + reach));
    Stamp stamp{left, top, (right - left) / kTogether + 1, bottom - top + 1};
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; column += kTogether) {
        Lanes covered{};
        for (int i = 0; i < 4 * kTogether; ++i) {
          const float distance = std::hypot(static_cast<float>(column + i / 4) - x, static_cast<float>(row) - y);
          covered[i] = static_cast<std::uint16_t>(255 * std::clamp(reach - distance, 0.0f, 1.0f) + 0.5f);
        }
        stamp.covered.push_back(covered);
      }
    }
    return stamp;
  }

  std::vector<Stamp> all_;
};

constexpr float kMaxRadius = 32;  // px

/// The stamps of a radius, in steps of 1/8 px, created on first use.
const Stamps& stamps_of(float radius) {
  constexpr float kSteps = 8;
  thread_local std::array<std::unique_ptr<Stamps>, static_cast<std::size_t>(kSteps * kMaxRadius) + 1> all;
  const auto index = static_cast<std::size_t>(std::clamp(radius, 1 / kSteps, kMaxRadius) * kSteps + 0.5f);
  if (all[index] == nullptr) all[index] = std::make_unique<Stamps>(static_cast<float>(index) / kSteps);
  return *all[index];
}

/// An image with four bytes per pixel and a border that contains all dots.
class Padded {
 public:
  explicit Padded(const Image<Rgb>& picture)
      : width_(picture.width()), height_(picture.height()), pixels_(width_ + 2 * kPad, height_ + 2 * kPad) {
    for (int y = 0; y < height_; ++y) {
      std::uint32_t* const row = pixels_.row(y + kPad) + kPad;
      for (int x = 0; x < width_; ++x) row[x] = wide(picture(x, y));
    }
  }

  void draw(const Dot& dot) {
    const bool reaches = dot.x > -kMaxReach && dot.x < static_cast<float>(width_) + kMaxReach && dot.y > -kMaxReach &&
                         dot.y < static_cast<float>(height_) + kMaxReach;
    if (!reaches) return;
    const int x = static_cast<int>(std::floor(dot.x * Stamps::kSteps + 0.5f));
    const int y = static_cast<int>(std::floor(dot.y * Stamps::kSteps + 0.5f));
    const Stamp& stamp = stamps_of(dot.radius).at(x & (Stamps::kSteps - 1), y & (Stamps::kSteps - 1));
    const int left = (x >> Stamps::kStepBits) + stamp.left + kPad, top = (y >> Stamps::kStepBits) + stamp.top + kPad;
    const std::uint32_t pixel = wide(dot.colour);
    const Lanes colour = __builtin_convertvector(bytes_of({pixel, pixel, pixel, pixel}), Lanes);
    const Lanes* covered = stamp.covered.data();
    for (int row = top; row < top + stamp.rows; ++row) {
      std::uint32_t* pixels = pixels_.row(row) + left;
      for (int i = 0; i < stamp.groups; ++i, pixels += kTogether) blend(pixels, colour, *covered++, dot.opacity);
    }
  }

  void take(Image<Rgb>& picture) const {
    for (int y = 0; y < height_; ++y) {
      const std::uint32_t* const row = pixels_.row(y + kPad) + kPad;
      for (int x = 0; x < width_; ++x) {
        picture(x, y) = {static_cast<std::uint8_t>(row[x]), static_cast<std::uint8_t>(row[x] >> 8),
                         static_cast<std::uint8_t>(row[x] >> 16)};
      }
    }
  }

 private:
  static constexpr float kMaxReach = kMaxRadius + 1;
  static constexpr int kPad = 2 * static_cast<int>(kMaxReach) + kTogether;

  static std::uint32_t wide(Rgb colour) {
    return std::uint32_t{colour.r} | std::uint32_t{colour.g} << 8 | std::uint32_t{colour.b} << 16;
  }
  static Bytes bytes_of(const std::array<std::uint32_t, kTogether>& pixels) { return std::bit_cast<Bytes>(pixels); }

  static void blend(std::uint32_t* pixels, const Lanes& colour, const Lanes& covered, std::uint16_t opacity) {
    Bytes bytes;
    std::memcpy(&bytes, pixels, sizeof bytes);
    const Lanes before = __builtin_convertvector(bytes, Lanes);
    Lanes amount = (covered * opacity + 128) >> 8;
    amount += amount >> 7;  // 256 is full coverage
    bytes = __builtin_convertvector((before * (256 - amount) + colour * amount + 128) >> 8, Bytes);
    std::memcpy(pixels, &bytes, sizeof bytes);
  }

  int width_, height_;
  Image<std::uint32_t> pixels_;
};

}  // namespace

void draw_dots(const std::vector<Dot>& dots, Image<Rgb>& picture) {
  thread_local std::vector<Dot> in_order;
  sort(dots, in_order);
  Padded padded(picture);
  for (const Dot& dot : in_order) padded.draw(dot);
  padded.take(picture);
}

}  // namespace esim::inline visualise
