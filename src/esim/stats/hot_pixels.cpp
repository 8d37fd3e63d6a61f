#include "esim/stats/hot_pixels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "esim/stats/numerics/median.h"
#include "esim/stats/numerics/probability.h"

namespace esim::inline stats {
namespace {

// A hot pixel exceeds its neighbours by this multiple of their difference. Pixels at the rims of wheels, recorded and
// simulated, reach 2.9.
constexpr double kUneven = 4;

struct Neighbours {
  double busy = 0;   // the second largest count of the neighbours
  double quiet = 0;  // the smallest
};

Neighbours around(const Image<std::uint32_t>& counts, int x, int y) {
  std::uint32_t largest = 0, second = 0, smallest = std::numeric_limits<std::uint32_t>::max();
  for (int v = std::max(0, y - 2); v <= std::min(counts.height() - 1, y + 2); ++v) {
    for (int u = std::max(0, x - 2); u <= std::min(counts.width() - 1, x + 2); ++u) {
      if (u == x && v == y) continue;
      smallest = std::min(smallest, counts(u, v));
      second = std::max(second, std::min(largest, counts(u, v)));
      largest = std::max(largest, counts(u, v));
    }
  }
  return {static_cast<double>(second), static_cast<double>(std::min(smallest, second))};
}

}  // namespace

double median_count(const Image<std::uint32_t>& counts) {
  return median(std::vector<double>(counts.pixels().begin(), counts.pixels().end()));
}

std::vector<HotPixel> find_hot_pixels(const Image<std::uint32_t>& counts, double sigmas) {
  if (counts.empty()) return {};
  std::vector<double> values(counts.pixels().begin(), counts.pixels().end());
  const double pixels = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / pixels;
  const double middle = median(values);
  for (double& value : values) value = std::abs(value - middle);
  const double sigma = std::max({1.0, std::sqrt(middle), 1.4826 * median(std::move(values))});

  std::vector<HotPixel> hot;
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) {
      const double events = counts(x, y);
      if (events <= middle + sigmas * sigma) continue;
      const Neighbours neighbours = around(counts, x, y);
      const double background = std::max({middle, mean, neighbours.busy});
      const double unevenness = neighbours.busy - neighbours.quiet;
      if (events <= background + std::max(background, kUneven * unevenness)) continue;
      if (poisson_tail(events, background) >= 0.01 / pixels) continue;
      hot.push_back({x, y, counts(x, y)});
    }
  }
  std::sort(hot.begin(), hot.end(), [](const HotPixel& a, const HotPixel& b) {
    return std::tuple(b.events, a.y, a.x) < std::tuple(a.events, b.y, b.x);
  });
  return hot;
}

}  // namespace esim::inline stats
