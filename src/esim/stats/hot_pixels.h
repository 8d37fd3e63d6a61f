#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"

namespace esim::inline stats {

/// A pixel with far more events than its neighbours.
struct HotPixel {
  int x = 0, y = 0;  ///< px
  std::uint64_t events = 0;
};

/// Pixels whose count n fulfils all four conditions, sorted by decreasing count. With m the median of all counts:
///
///   n > m + sigmas s,  s = max(1, sqrt(m), 1.4826 median |count - m|)       among all pixels, robustly
///   n > 2 b            b = max(m, mean, c)
///   n > b + 4 (c - l)                                                       among its neighbours
///   P(X >= n) < 0.01 / pixels     for X ~ Poisson(b)                        not by chance
///
/// with c the second largest and l the smallest count of the 5 x 5 pixels around it, without the pixel itself. Objects
/// that move across the sensor raise the counts of whole neighbourhoods, and so c; the second largest count allows two
/// adjacent hot pixels. At the limit of the motion, as at the rim of a wheel, neighbours differ by as much as c - l,
/// and single pixels have several times c events, because an edge changes their brightness by one threshold more: they
/// are hot only if they exceed that difference by far.
std::vector<HotPixel> find_hot_pixels(const Image<std::uint32_t>& counts, double sigmas);

/// Median of the counts: the mean of the two in the middle for an even number, 0 for an empty image.
double median_count(const Image<std::uint32_t>& counts);

}  // namespace esim::inline stats
