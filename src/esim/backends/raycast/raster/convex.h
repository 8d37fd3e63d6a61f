#pragma once

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline backends::inline raycast {

namespace hn = hwy::HWY_NAMESPACE;

/// As many floats as a vector of the processor has, at most 8.
using EightFloats = hn::CappedTag<float, 8>;

/// A bit for each lane of a mask of these.
template <class Mask>
unsigned bits_of(Mask mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(EightFloats(), mask, bits);
  return bits[0];
}

/// A bit for each weight of a mask of the weights and the inverse depth.
template <class Mask>
unsigned edges_of(Mask mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(hn::FixedTag<float, 4>(), mask, bits);
  return bits[0] & 7U;
}

/// A position in a pixel, from its centre: [-0.5, 0.5] x [-0.5, 0.5].
struct PixelPoint {
  float s, t;
};

/// A linear function of the position in a pixel.
struct OfPixel {
  float middle, s, t;

  float at(const PixelPoint& p) const { return middle + s * p.s + t * p.t; }

  /// Half of the range of its values.
  float reach() const { return 0.5F * (std::fabs(s) + std::fabs(t)); }
};

/// Integrals over an area in a pixel.
struct Moments {
  float area = 0, s = 0, t = 0, ss = 0, st = 0, tt = 0;  ///< of 1, of the position, and of its products

  static Moments pixel() { return {1, 0, 0, 1.0F / 12, 0, 1.0F / 12}; }

  Moments& operator+=(const Moments& other) {
    area += other.area, s += other.s, t += other.t, ss += other.ss, st += other.st, tt += other.tt;
    return *this;
  }
  Moments& operator-=(const Moments& other) {
    area -= other.area, s -= other.s, t -= other.t, ss -= other.ss, st -= other.st, tt -= other.tt;
    return *this;
  }
  void scale(float factor) { area *= factor, s *= factor, t *= factor, ss *= factor, st *= factor, tt *= factor; }
  void add(float weight, float at_s, float at_t) { area += weight, s += weight * at_s, t += weight * at_t; }
  void add_products(float weight, float at_s, float at_t) {
    ss += weight * at_s * at_s, st += weight * at_s * at_t, tt += weight * at_t * at_t;
  }
};

/// A convex polygon in a pixel, empty if it has fewer than three corners.
class Convex {
  using D = EightFloats;
  static constexpr std::size_t kVector = hn::MaxLanes(D());

  /// Of f at the corners from i on.
  auto values(const OfPixel& f, std::size_t i) const {
    const D d;
    const auto middle = hn::MulAdd(hn::Set(d, f.t), hn::Load(d, &t_[i]), hn::Set(d, f.middle));
    return hn::MulAdd(hn::Set(d, f.s), hn::Load(d, &s_[i]), middle);
  }

 public:
  static constexpr std::size_t kMaxCorners = 16;

  static Convex pixel() {
    Convex square;
    for (const auto& [s, t] : {PixelPoint{-0.5F, -0.5F}, {0.5F, -0.5F}, {0.5F, 0.5F}, {-0.5F, 0.5F}}) square.add(s, t);
    square.close();
    return square;
  }

  bool empty() const { return count_ < 3; }
  PixelPoint first() const { return {s_[0], t_[0]}; }  ///< corner

  /// Whether there is room for the corners of this many cuts.
  bool can_be_cut(std::size_t times) const { return count_ + times <= kMaxCorners; }

  /// Whether f is at most `max` on it; whether |f| is. It must not be empty.
  bool is_below(const OfPixel& f, float max) const {
    const D d;
    const auto limit = hn::Set(d, max);
    for (std::size_t i = 0; i < count_; i += kVector) {
      if (!hn::AllTrue(d, hn::Le(values(f, i), limit))) return false;
    }
    return true;
  }
  bool is_near_zero(const OfPixel& f, float max) const {
    const D d;
    const auto limit = hn::Set(d, max);
    for (std::size_t i = 0; i < count_; i += kVector) {
      if (!hn::AllTrue(d, hn::Le(hn::Abs(values(f, i)), limit))) return false;
    }
    return true;
  }

  /// Keeps the part where f is not negative; the remainder becomes `rest`. Only if it can be cut. It stays whole if f
  /// is at least -`touch` on it, or at most `touch`.
  void cut(const OfPixel& f, Convex& rest, float touch = 0) {
    const D d;
    const auto low = hn::Set(d, -touch), high = hn::Set(d, touch);
    alignas(64) std::array<float, kMaxCorners> at;
    bool none_below = true, all_below = true;
    std::uint32_t inside = 0;  // a bit for each corner
    for (std::size_t i = 0; i < count_; i += kVector) {
      const auto value = values(f, i);
      hn::Store(value, d, &at[i]);
      none_below = none_below && hn::AllTrue(d, hn::Ge(value, low));
      all_below = all_below && hn::AllTrue(d, hn::Lt(value, high));
      std::array<std::uint8_t, 8> bits{};
      hn::StoreMaskBits(d, hn::Ge(value, hn::Zero(d)), bits.data());
      inside |= std::uint32_t{bits[0]} << i;
    }
    rest.count_ = 0;
    if (none_below) return;
    if (all_below) return std::swap(*this, rest);
    const std::uint32_t all = (1U << count_) - 1, next = (inside & all) >> 1 | (inside & 1) << (count_ - 1);
    const auto last_inside = static_cast<std::size_t>(std::countr_zero(all & inside & ~next));
    const auto last_outside = static_cast<std::size_t>(std::countr_zero(all & ~inside & next));
    const PixelPoint exit = between(at, last_inside), entry = between(at, last_outside);
    Convex kept;
    kept.add(*this, last_outside, last_inside), rest.add(*this, last_inside, last_outside);
    kept.add(exit.s, exit.t), kept.add(entry.s, entry.t), kept.close();
    rest.add(entry.s, entry.t), rest.add(exit.s, exit.t), rest.close();
    *this = kept;
  }

  void integrate(Moments& sum) const {
    for (std::size_t i = 2; i < count_; ++i) {
      const float twice = std::fabs((s_[i - 1] - s_[0]) * (t_[i] - t_[0]) - (t_[i - 1] - t_[0]) * (s_[i] - s_[0]));
      const float s = s_[0] + s_[i - 1] + s_[i], t = t_[0] + t_[i - 1] + t_[i];
      sum.add(0.5F * twice, s / 3, t / 3);
      // The products over a triangle: a twelfth of its area times those of its corners, and of the sum of its corners.
      for (const std::size_t corner : {std::size_t{0}, i - 1, i}) sum.add_products(twice / 24, s_[corner], t_[corner]);
      sum.add_products(twice / 24, s, t);
    }
  }

 private:
  void add(float s, float t) { s_[count_] = s, t_[count_] = t, ++count_; }

  /// Adds the corners of a polygon after `first`, up to `last`.
  void add(const Convex& from, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i != last;) {
      i = i + 1 < from.count_ ? i + 1 : 0;
      add(from.s_[i], from.t_[i]);
    }
  }

  /// Where a function is 0 between corner i and the next one, with different signs at both.
  PixelPoint between(const std::array<float, kMaxCorners>& at, std::size_t i) const {
    const std::size_t j = i + 1 < count_ ? i + 1 : 0;
    const float along = at[i] / (at[i] - at[j]);
    return {s_[i] + along * (s_[j] - s_[i]), t_[i] + along * (t_[j] - t_[i])};
  }

  /// Repeats the first corner in the remaining lanes of the last vector.
  void close() {
    for (std::size_t i = count_; i % kVector != 0; ++i) s_[i] = s_[0], t_[i] = t_[0];
  }

  alignas(64) std::array<float, kMaxCorners> s_, t_;
  std::size_t count_ = 0;
};

}  // namespace esim::inline backends::inline raycast
