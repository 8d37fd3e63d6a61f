#include "esim/stats/hot_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace esim {
namespace {

Image<std::uint32_t> poisson_counts(int width, int height, double mean, unsigned seed) {
  std::mt19937 random(seed);
  std::poisson_distribution<std::uint32_t> count(mean);
  Image<std::uint32_t> counts(width, height);
  for (std::uint32_t& value : counts.pixels()) value = count(random);
  return counts;
}

TEST(HotPixels, PlantedOnesAreFoundAndNoOthers) {
  for (const double mean : {0.02, 1.0, 30.0, 2000.0}) {
    auto counts = poisson_counts(120, 90, mean, 5);
    EXPECT_TRUE(find_hot_pixels(counts, 5).empty()) << mean;
    const auto hot = static_cast<std::uint32_t>(4 * mean + 40);
    counts(0, 0) = hot;
    counts(60, 30) = hot + 3;
    counts(61, 30) = hot + 2;  // beside another
    counts(119, 89) = hot + 1;
    const std::vector<HotPixel> found = find_hot_pixels(counts, 5);
    ASSERT_EQ(found.size(), 4u) << mean;
    EXPECT_EQ(found[0].x, 60);
    EXPECT_EQ(found[0].y, 30);
    EXPECT_EQ(found[0].events, hot + 3);
    EXPECT_EQ(found[1].x, 61);
    EXPECT_EQ(found[2].x, 119);
    EXPECT_EQ(found[3].x, 0);
  }
}

// A line of texture, one pixel wide, heats all that it passes along.
TEST(HotPixels, TextureIsNotHot) {
  auto counts = poisson_counts(120, 90, 5, 6);
  for (int x = 0; x < 120; ++x) counts(x, 40) += 400;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 30; ++x) counts(x, y) += 300;
  }
  EXPECT_TRUE(find_hot_pixels(counts, 5).empty());
}

TEST(HotPixels, Nothing) {
  EXPECT_TRUE(find_hot_pixels({}, 5).empty());
  EXPECT_TRUE(find_hot_pixels(Image<std::uint32_t>(10, 10), 5).empty());
  EXPECT_TRUE(find_hot_pixels(Image<std::uint32_t>(1, 1, 1000), 5).empty());
}

TEST(MedianCount, OddEvenAndNone) {
  Image<std::uint32_t> counts(2, 2);
  counts(0, 0) = 7, counts(1, 0) = 1, counts(0, 1) = 2, counts(1, 1) = 100;
  EXPECT_EQ(median_count(counts), 4.5);
  EXPECT_EQ(median_count(Image<std::uint32_t>(3, 1, 8)), 8);
  EXPECT_EQ(median_count({}), 0);
}

}  // namespace
}  // namespace esim
