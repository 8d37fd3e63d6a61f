#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace esim::inline backends::inline raycast {

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

/// A convex polygon in a pixel, empty if it has fewer than three corners.
class Convex {
 public:
  static constexpr std::size_t kMaxCorners = 32;

  static Convex pixel() {
    Convex square;
    for (const auto& [s, t] : {PixelPoint{-0.5F, -0.5F}, {0.5F, -0.5F}, {0.5F, 0.5F}, {-0.5F, 0.5F}})
      square.add({s, t});
    return square;
  }

  bool empty() const { return count_ < 3; }

  /// Whether there is room for the corners of this many cuts.
  bool can_be_cut(std::size_t times) const { return count_ + times + 1 <= kMaxCorners; }

  /// The largest value of f on it, or an upper bound of |f| (f times a sign).
  float max(const OfPixel& f) const {
    float most = f.at(corners_[0]);
    for (std::size_t i = 1; i < count_; ++i) most = std::max(most, f.at(corners_[i]));
    return most;
  }
  float max_abs(const OfPixel& f) const {
    float most = 0;
    for (std::size_t i = 0; i < count_; ++i) most = std::max(most, std::fabs(f.at(corners_[i])));
    return most;
  }

  /// Keeps the part where f is not negative; the remainder becomes `rest`. Only if it can be cut.
  void cut(const OfPixel& f, Convex& rest) {
    Convex kept;
    rest.count_ = 0;
    float here = count_ > 0 ? f.at(corners_[0]) : 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const PixelPoint &from = corners_[i], &to = corners_[i + 1 < count_ ? i + 1 : 0];
      const float next = f.at(to);
      (here >= 0 ? kept : rest).add(from);
      if ((here >= 0) != (next >= 0)) {
        const float along = here / (here - next);
        const PixelPoint crossing{from.s + along * (to.s - from.s), from.t + along * (to.t - from.t)};
        kept.add(crossing), rest.add(crossing);
      }
      here = next;
    }
    *this = kept;
  }

  /// Adds the area, and the area times the centroid.
  void integrate(float& area, float& first_s, float& first_t) const {
    for (std::size_t i = 2; i < count_; ++i) {
      const PixelPoint &a = corners_[0], &b = corners_[i - 1], &c = corners_[i];
      const float twice = std::fabs((b.s - a.s) * (c.t - a.t) - (b.t - a.t) * (c.s - a.s));
      area += 0.5F * twice;
      first_s += twice * (a.s + b.s + c.s) / 6, first_t += twice * (a.t + b.t + c.t) / 6;
    }
  }

 private:
  void add(const PixelPoint& corner) { corners_[count_++] = corner; }

  std::array<PixelPoint, kMaxCorners> corners_;
  std::size_t count_ = 0;
};

}  // namespace esim::inline backends::inline raycast
