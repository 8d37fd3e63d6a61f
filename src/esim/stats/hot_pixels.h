#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"

namespace esim {

/// A pixel with far more events than those around it.
struct HotPixel {
  int x = 0, y = 0;  ///< px
  std::uint64_t events = 0;
};

/// Pixels whose count n stands out in every respect, most events first. With m the median of all counts:
///
///   n > m + sigmas s,  s = max(1, sqrt(m), 1.4826 median |count - m|)       among all pixels, robustly
///   n > 2 b            b = max(m, mean, second largest count of the 5 x 5 pixels around it, without itself)
///   P(X >= n) < 0.01 / pixels     for X ~ Poisson(b)                        not by chance
///
/// Texture that moves across the sensor heats whole neighbourhoods, which b takes away; two hot pixels may touch.
std::vector<HotPixel> find_hot_pixels(const Image<std::uint32_t>& counts, double sigmas);

/// Median of the counts: of an even number of them, the mean of the two in the middle. 0 if there are none.
double median_count(const Image<std::uint32_t>& counts);

}  // namespace esim
