#include "esim/stats/hot_pixels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
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
    counts(61, 30) = hot + 2;  // next to another one
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

// A line of texture, one pixel wide, raises the counts of all pixels along its path.
TEST(HotPixels, TextureIsNotHot) {
  auto counts = poisson_counts(120, 90, 5, 6);
  for (int x = 0; x < 120; ++x) counts(x, 40) += 400;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 30; ++x) counts(x, y) += 300;
  }
  EXPECT_TRUE(find_hot_pixels(counts, 5).empty());
}

constexpr double kPi = std::numbers::pi;

/// Irradiance at (u, v), px from the centre of a wheel with a radius of 20.3 px: spokes, and a tyre with knobs.
double wheel(double u, double v, double angle) {
  constexpr double kRadius = 20.3;
  const double r = std::hypot(u, v), a = std::atan2(v, u) - angle;
  const bool tyre = std::abs(r - kRadius) < 0.06 * kRadius;
  if (tyre && r > kRadius && std::sin(40 * a) > 0.3) return 0.35;
  if (r < 0.95 * kRadius && std::abs(std::sin(1.5 * a)) * r < 0.05 * kRadius) return 0.9;
  return tyre ? 0.12 : 0.55;
}

/// Event counts for one turn of the wheel in the middle of a sensor of 140 x 140 px.
Image<std::uint32_t> counts_of_a_wheel(double threshold) {
  constexpr int kSize = 140, kFirst = 46, kEnd = 94, kSteps = 480, kSamples = 4;
  Image<std::uint32_t> counts(kSize, kSize);
  for (int y = kFirst; y < kEnd; ++y) {
    for (int x = kFirst; x < kEnd; ++x) {
      double reference = 0;
      for (int step = 0; step < kSteps; ++step) {
        double sum = 0;
        for (int i = 0; i < kSamples * kSamples; ++i) {
          const double u = x + (i % kSamples + 0.5) / kSamples - kSize / 2.0;
          const double v = y + (i / kSamples + 0.5) / kSamples - kSize / 2.0;
          sum += wheel(u, v, 2 * kPi * step / kSteps);
        }
        const double brightness = std::log(sum / (kSamples * kSamples) + 1e-3);
        if (step == 0) reference = brightness;
        const double levels = std::trunc((brightness - reference) / threshold);
        counts(x, y) += static_cast<std::uint32_t>(std::abs(levels));
        reference += levels * threshold;
      }
    }
  }
  return counts;
}

TEST(HotPixels, TheRimOfAWheelIsNotHot) {
  for (const double threshold : {0.15, 0.5}) {
    auto counts = counts_of_a_wheel(threshold);
    EXPECT_TRUE(find_hot_pixels(counts, 5).empty()) << threshold;
    // Hot pixels outside the wheel, at its rim and on a spoke's path are found.
    const std::uint32_t busiest = *std::max_element(counts.pixels().begin(), counts.pixels().end());
    for (const auto& [x, y] : {std::pair{10, 120}, {70, 49}, {91, 70}, {60, 70}}) counts(x, y) += 6 * busiest;
    EXPECT_EQ(find_hot_pixels(counts, 5).size(), 4u) << threshold;
  }
}

// Around a pixel at the rim of a recorded wheel: one pixel crosses two levels more than its neighbours.
TEST(HotPixels, NeighboursAsUnevenAsARimAreNotHot) {
  constexpr std::uint32_t kRim[7][7] = {{48, 48, 48, 48, 48, 48, 46}, {48, 48, 48, 48, 48, 24, 46},
                                        {48, 48, 48, 48, 48, 47, 46}, {0, 0, 24, 130, 48, 23, 46},
                                        {0, 0, 0, 0, 0, 0, 23},       {0, 0, 0, 0, 0, 0, 0},
                                        {0, 0, 0, 0, 0, 0, 0}};
  Image<std::uint32_t> counts(100, 100);
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 7; ++x) counts(40 + x, 40 + y) = kRim[y][x];
  }
  EXPECT_TRUE(find_hot_pixels(counts, 5).empty());
  counts(43, 43) = 300;
  ASSERT_EQ(find_hot_pixels(counts, 5).size(), 1u);
  EXPECT_EQ(find_hot_pixels(counts, 5)[0].x, 43);
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
