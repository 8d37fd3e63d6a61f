#pragma once

#include <cstdint>

#include "esim/backends/raycast/raster/convex.h"

// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline backends::inline raycast {

/// Variances and covariance of the positions in an area. The defaults are those of a complete pixel.
struct Spread {
  float ss = 1.0F / 12, st = 0, tt = 1.0F / 12;
};

/// Smaller parts of a pixel are ignored.
inline constexpr float kSmallestArea = 2e-5F;

/// A visible part of a pixel that is shaded once: that of a triangle, or of a continuous surface.
struct Fragment {
  std::uint32_t triangle = 0;  ///< of the cell's: the largest one, if there are several
  std::uint16_t pixel = 0;     ///< of the cell
  PixelPoint centroid{};
  Spread spread;
  float area = 0;           ///< fraction of the pixel
  std::uint64_t samples{};  ///< a bit for each sample for shadows at which it is visible, if requested

  Fragment() = default;
  /// A complete pixel.
  Fragment(std::uint32_t of_triangle, std::uint16_t of_pixel) : triangle(of_triangle), pixel(of_pixel), area(1) {}
  Fragment(std::uint32_t of_triangle, std::uint16_t of_pixel, const Moments& sum)
      : triangle(of_triangle), pixel(of_pixel), centroid{sum.s / sum.area, sum.t / sum.area}, area(sum.area) {
    const auto [s, t] = centroid;
    spread = {sum.ss / area - s * s, sum.st / area - s * t, sum.tt / area - t * t};
  }

  /// Integrals over its area.
  Moments moments() const {
    const auto [s, t] = centroid;
    return {
        area, area * s, area * t, area * (spread.ss + s * s), area * (spread.st + s * t), area * (spread.tt + t * t)};
  }
};

/// What is seen in the middle of a pixel.
struct SeenInMiddle {
  float inverse_depth = 0;  ///< 0: nothing
  std::uint32_t group = 0;
  std::uint32_t triangle = 0;  ///< of the cell's
};

}  // namespace esim::inline backends::inline raycast
