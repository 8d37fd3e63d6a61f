#include "esim/compare/event_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

namespace esim {
namespace {

/// Events at times in milliseconds, OFF if negative: {1, -3} is ON at 1 ms and OFF at 3 ms.
std::vector<PixelEvent> events(const std::vector<double>& signed_ms) {
  std::vector<PixelEvent> all;
  for (const double t : signed_ms) all.push_back({to_ns(std::abs(t) * 1e-3), static_cast<std::int8_t>(t > 0 ? 1 : -1)});
  return all;
}

EventMatch match(const std::vector<double>& reference, const std::vector<double>& other) {
  return match_events(events(reference), events(other));
}

void expect_differences_ms(EventMatch match, std::vector<double> expected) {
  std::sort(match.differences_s.begin(), match.differences_s.end());
  std::sort(expected.begin(), expected.end());
  ASSERT_EQ(match.differences_s.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(match.differences_s[i] * 1e3, expected[i], 1e-9);
}

TEST(EventMatching, PairsIdenticalSequencesInOrder) {
  const EventMatch found = match({1, 2, -40}, {1.5, 1.9, -80});  // however far apart
  EXPECT_TRUE(found.identical);
  EXPECT_EQ(found.missing + found.spurious, 0);
  expect_differences_ms(found, {0.5, -0.1, 40});
  EXPECT_TRUE(match({}, {}).identical);
}

TEST(EventMatching, FindsTheMissingOneOfMany) {
  const EventMatch found = match({1, 2, 3, 4}, {1.1, 3.1, 4.1});
  EXPECT_FALSE(found.identical);
  EXPECT_EQ(found.missing, 1);
  EXPECT_EQ(found.spurious, 0);
  expect_differences_ms(found, {0.1, 0.1, 0.1});
}

TEST(EventMatching, FindsTheSpuriousPair) {
  const EventMatch found = match({1, 5}, {1, 2, -3, 5});
  EXPECT_EQ(found.missing, 0);
  EXPECT_EQ(found.spurious, 2);
  expect_differences_ms(found, {0, 0});
}

TEST(EventMatching, NeverPairsAcrossPolarities) {
  const EventMatch found = match({1, -2}, {-1, 2});
  EXPECT_FALSE(found.identical);
  EXPECT_EQ(found.missing, 1);
  EXPECT_EQ(found.spurious, 1);
  EXPECT_EQ(found.differences_s.size(), 1U) << "the pairs would cross";
}

TEST(EventMatching, LeavesEventsAloneThatAreTooFarApart) {
  EXPECT_EQ(match({1}, {20.9, 30}).differences_s.size(), 1U);
  const EventMatch found = match({1}, {21.1, 30});
  EXPECT_EQ(found.missing, 1);
  EXPECT_EQ(found.spurious, 2);
}

TEST(EventMatching, HasTheLowestCostOfAllPairings) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const double duration_ms = trial % 3 == 0 ? 10 : trial % 3 == 1 ? 60 : 300;
    const auto draw = [&] {
      std::vector<PixelEvent> drawn;
      for (auto i = random() % 12; i > 0; --i) {
        const double t = duration_ms * 1e-3 * static_cast<double>(random()) / 4294967296.0;
        drawn.push_back({to_ns(t), static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)});
      }
      std::sort(drawn.begin(), drawn.end(), [](const PixelEvent& a, const PixelEvent& b) { return a.t < b.t; });
      return drawn;
    };
    const std::vector<PixelEvent> a = draw(), b = draw();
    const EventMatch found = match_events(a, b);
    if (found.identical) continue;
    std::map<std::pair<std::size_t, std::size_t>, double> known;
    const std::function<double(std::size_t, std::size_t)> lowest = [&](std::size_t i, std::size_t j) {
      const auto [at, is_new] = known.try_emplace({i, j}, 1e9);
      if (!is_new) return at->second;
      double best = static_cast<double>(i + j) * 10e-3;
      if (i > 0) best = std::min(best, lowest(i - 1, j) + 10e-3);
      if (j > 0) best = std::min(best, lowest(i, j - 1) + 10e-3);
      if (i > 0 && j > 0 && a[i - 1].polarity == b[j - 1].polarity)
        best = std::min(best, lowest(i - 1, j - 1) + std::abs(to_seconds(a[i - 1].t - b[j - 1].t)));
      return known[{i, j}] = best;
    };
    double cost = static_cast<double>(found.missing + found.spurious) * 10e-3;
    for (const double difference_s : found.differences_s) cost += std::abs(difference_s);
    EXPECT_NEAR(cost, lowest(a.size(), b.size()), 1e-9) << trial;
    EXPECT_EQ(a.size() - found.differences_s.size(), static_cast<std::size_t>(found.missing));
    EXPECT_EQ(b.size() - found.differences_s.size(), static_cast<std::size_t>(found.spurious));
  }
}

TEST(EventMatching, OfHotPixelsNeedsLittleMemory) {
  std::vector<PixelEvent> a, b;  // all pairs would be 4e10
  for (int i = 0; i < 200'000; ++i) {
    a.push_back({i * kNsPerMs, 1});
    if (i % 100 != 0) b.push_back({i * kNsPerMs + 1000, 1});
  }
  const EventMatch found = match_events(a, b);
  EXPECT_EQ(found.missing, 2000);
  EXPECT_EQ(found.spurious, 0);
}

TEST(EventMatching, OfNothingAndSomething) {
  EXPECT_EQ(match({}, {1, 2}).spurious, 2);
  EXPECT_EQ(match({1, -2, 3}, {}).missing, 3);
}

TEST(EventComparison, CountsOverPixels) {
  const std::vector<Event> reference = {{1000, 0, 0, 1}, {2000, 1, 0, 1}, {3000, 0, 0, -1}, {4000, 2, 1, 1}};
  const std::vector<Event> other = {
      {1500, 0, 0, 1}, {2000, 1, 0, 1}, {3500, 0, 0, -1}, {5000, 1, 0, 1}, {6000, 1, 1, 1}};
  const EventComparison found = compare_events(EventsByPixel(reference, 3, 2), EventsByPixel(other, 3, 2));
  EXPECT_EQ(found.reference, 4);
  EXPECT_EQ(found.events, 5);
  EXPECT_EQ(found.matched, 3);
  EXPECT_EQ(found.missing, 1);
  EXPECT_EQ(found.spurious, 2);
  EXPECT_EQ(found.active_pixels, 4);
  EXPECT_EQ(found.identical_pixels, 1);
  EXPECT_DOUBLE_EQ(found.median_s, 500e-9);
  EXPECT_DOUBLE_EQ(found.count_ratio(), 1.25);
  EXPECT_EQ(found.reference, found.matched + found.missing);
  EXPECT_EQ(found.events, found.matched + found.spurious);
}

}  // namespace
}  // namespace esim
