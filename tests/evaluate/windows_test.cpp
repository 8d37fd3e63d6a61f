#include "esim/evaluate/windows.h"

#include <gtest/gtest.h>

#include <set>

namespace esim {
namespace {

/// 10 s at 10 Hz: 100 px/s, but 20 px/s from 2 to 4 s and 500 px/s from 6 to 8 s.
MotionCurve steps() {
  MotionCurve motion{5 * kNsPerSecond, 10, {}, 0, 0};
  for (int k = 0; k <= 100; ++k) motion.mean_px_per_s.push_back(k > 20 && k < 40 ? 20 : k > 60 && k < 80 ? 500 : 100);
  return motion;
}

TEST(Windows, LieWhereTheMotionIsSlowestAndFastest) {
  const TimeSpan all{5 * kNsPerSecond, 15 * kNsPerSecond};
  const std::vector<Window> windows = choose_windows(steps(), all, 1.5);
  ASSERT_EQ(windows.size(), 3U);
  EXPECT_EQ(windows[0].name, "slow");
  EXPECT_EQ(windows[0].mean_px_per_s, 20);
  EXPECT_GE(windows[0].span.start, 7 * kNsPerSecond);
  EXPECT_LE(windows[0].span.end, 9 * kNsPerSecond);
  EXPECT_EQ(windows[0].span.end - windows[0].span.start, to_ns(1.5));
  EXPECT_EQ(windows[1].name, "fast");
  EXPECT_EQ(windows[1].mean_px_per_s, 500);
  EXPECT_EQ(windows[2].name, "all");
  EXPECT_EQ(windows[2].span.end, all.end);
  EXPECT_EQ(choose_windows(steps(), all, 6).size(), 1U) << "windows longer than half of the time";
}

TEST(Windows, HaveATypicalPart) {
  const Window window{"w", {8 * kNsPerSecond, 13 * kNsPerSecond}, 490};
  const TimeSpan part = typical_part(steps(), window, 0.5);
  EXPECT_EQ(part.end - part.start, to_ns(0.5));
  EXPECT_EQ(steps().mean(part), 500);
  EXPECT_EQ(typical_part(steps(), window, 100).end, window.span.end) << "not longer than the window";
}

TEST(Windows, ShorterThanTheMotionsIntervalHaveTheNearestMotion) {
  EXPECT_EQ(steps().mean({to_ns(8.01), to_ns(8.02)}), 20);
}

TEST(Pixels, AreDifferentAndSpread) {
  const std::vector<PixelPosition> pixels = spread_pixels(346, 260, 400);
  ASSERT_EQ(pixels.size(), 400U);
  std::set<std::pair<int, int>> different, cells;
  for (const PixelPosition& p : pixels) {
    ASSERT_TRUE(p.x >= 0 && p.x < 346 && p.y >= 0 && p.y < 260);
    different.insert({p.x, p.y});
    cells.insert({p.x * 10 / 346, p.y * 8 / 260});
  }
  EXPECT_EQ(different.size(), 400U);
  EXPECT_EQ(cells.size(), 80U) << "a part of the image has no pixel";
  EXPECT_EQ(spread_pixels(4, 3, 0).size(), 12U);
  EXPECT_EQ(spread_pixels(4, 3, 100).size(), 12U);
  EXPECT_EQ(spread_pixels(4, 3, 11).size(), 11U);
}

TEST(PixelIndex, FindsThoseInATile) {
  const std::vector<PixelPosition> pixels = spread_pixels(100, 70, 300);
  const PixelIndex index(100, 70, pixels);
  for (const Tile& tile : {Tile{0, 0, 100, 70}, Tile{3, 5, 40, 20}, Tile{96, 64, 4, 6}, Tile{16, 16, 16, 16}}) {
    std::set<int> found, expected;
    index.for_each_in(tile, [&](int i) { EXPECT_TRUE(found.insert(i).second); });
    for (int i = 0; i < 300; ++i) {
      const PixelPosition& p = pixels[static_cast<std::size_t>(i)];
      if (p.x >= tile.x && p.x < tile.x + tile.width && p.y >= tile.y && p.y < tile.y + tile.height) expected.insert(i);
    }
    EXPECT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace esim
