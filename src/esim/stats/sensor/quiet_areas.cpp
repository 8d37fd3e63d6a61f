#include "esim/stats/sensor/quiet_areas.h"

#include <algorithm>
#include <cmath>

#include "esim/stats/numerics/probability.h"

namespace esim::inline stats {
namespace {

constexpr double kSignificance = 1e-3;
constexpr double kMaxChance = 0.3;

int extent(int block, int size) { return std::min(BlockCounts::kSize, size - block * BlockCounts::kSize); }

bool moves(const BlockCounts& block, int pixels, double duration_s) {
  const double events = block.events;
  const double neighbours_hz = 8 * events / (pixels * duration_s);
  const double chance = -std::expm1(-neighbours_hz * to_seconds(kSupport));
  if (block.supported == 0) return false;
  return chance > kMaxChance || poisson_tail(block.supported, events * chance) < kSignificance;
}

}  // namespace

QuietAreas find_quiet_areas(const Image<BlockCounts>& blocks, int width, int height, double duration_s) {
  QuietAreas quiet;
  quiet.duration_s = duration_s;
  if (!(duration_s > 0)) return quiet;
  Image<std::uint8_t> moving(blocks.width(), blocks.height());
  for (int v = 0; v < blocks.height(); ++v) {
    for (int u = 0; u < blocks.width(); ++u)
      moving(u, v) = moves(blocks(u, v), extent(u, width) * extent(v, height), duration_s) ? 1 : 0;
  }
  for (int v = 0; v < blocks.height(); ++v) {
    for (int u = 0; u < blocks.width(); ++u) {
      bool near = false;
      for (int j = std::max(0, v - 1); j <= std::min(blocks.height() - 1, v + 1); ++j) {
        for (int i = std::max(0, u - 1); i <= std::min(blocks.width() - 1, u + 1); ++i) near |= moving(i, j) != 0;
      }
      if (near) continue;
      const int pixels = extent(u, width) * extent(v, height);
      quiet.blocks.push_back({static_cast<std::uint64_t>(pixels), blocks(u, v).events});
      quiet.all.pixels += quiet.blocks.back().pixels;
      quiet.all.events += quiet.blocks.back().events;
    }
  }
  return quiet;
}

}  // namespace esim::inline stats
