#include "esim/reproject/disagreement.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "esim/core/fast_log.h"

namespace esim::inline reproject {
namespace {

constexpr int kBlock = 8;         // px
constexpr double kShare = 0.998;  // percentile of the blocks

}  // namespace

double disagreement(const Reconstruction& apart, double log_eps) {
  const Image<float>&before = apart.from_before, &after = apart.from_after;
  const float eps = static_cast<float>(log_eps);
  std::vector<double> blocks;
  for (int top = 0; top < before.height(); top += kBlock) {
    for (int left = 0; left < before.width(); left += kBlock) {
      const int bottom = std::min(top + kBlock, before.height()), right = std::min(left + kBlock, before.width());
      double sum = 0;
      int count = 0;
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          if (before(x, y) < 0 || after(x, y) < 0) continue;
          sum += fast_log((before(x, y) + eps) / (after(x, y) + eps));
          ++count;
        }
      }
      if (4 * count >= (bottom - top) * (right - left)) blocks.push_back(std::fabs(sum / count));
    }
  }
  if (blocks.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(kShare * static_cast<double>(blocks.size() - 1));
  std::nth_element(blocks.begin(), blocks.begin() + rank, blocks.end());
  return blocks[static_cast<std::size_t>(rank)];
}

}  // namespace esim::inline reproject
