#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"

namespace esim::inline stats {

/// Events of the blocks of 8 x 8 px of a sensor.
struct BlockCounts {
  static constexpr int kSize = 8;  ///< px

  std::uint32_t events = 0;
  std::uint32_t supported = 0;  ///< events whose 8 neighbours fired in the kSupport before
};

inline constexpr TimeNs kSupport = 5 * kNsPerMs;

/// The part of a sensor without motion, which shows the noise of its pixels.
struct QuietAreas {
  struct Block {
    std::uint64_t pixels = 0, events = 0;
  };
  std::vector<Block> blocks;
  Block all;
  double duration_s = 0;

  /// Of a pixel; NaN without quiet pixels.
  double rate_hz() const {
    if (all.pixels == 0) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(all.events) / (static_cast<double>(all.pixels) * duration_s);
  }
};

/// Motion crosses neighbouring pixels within a short time, and noise does not. In a block with n events of a pixels in
/// the duration T, independent events would be supported with the probability p = 1 - exp(-8 n kSupport / (a T)). The
/// block moves if it has s supported events and P(X >= s) < 0.001 for X ~ Poisson(n p), or if
/// p > 0.3 (9 Hz): there, motion and noise cannot be distinguished. A block is quiet if neither it
/// nor its 8 neighbours move. The selection depends on neighbours in time only, and hardly on the rate of the noise.
QuietAreas find_quiet_areas(const Image<BlockCounts>& blocks, int width, int height, double duration_s);

}  // namespace esim::inline stats
