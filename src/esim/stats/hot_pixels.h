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
///   n > 2 b            b = max(m, mean, c)
///   n > b + 4 (c - l)                                                       among its neighbours
///   P(X >= n) < 0.01 / pixels     for X ~ Poisson(b)                        not by chance
///
/// with c the second largest and l the smallest count of the 5 x 5 pixels around it, without itself. What moves across
/// the sensor heats whole neighbourhoods, which c takes away; two hot pixels may touch. Where it ends, as at the rim of
/// a wheel, neighbours differ as much as c - l, and single pixels get several times the events of c, because an edge
/// changes their light by one threshold more: they are hot only far beyond that difference.
std::vector<HotPixel> find_hot_pixels(const Image<std::uint32_t>& counts, double sigmas);

/// Median of the counts: of an even number of them, the mean of the two in the middle. 0 if there are none.
double median_count(const Image<std::uint32_t>& counts);

}  // namespace esim
