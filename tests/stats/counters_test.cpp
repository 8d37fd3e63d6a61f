#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "esim/stats/interval_histogram.h"
#include "esim/stats/rate_curve.h"
#include "esim/stats/stream_sample.h"
#include "stats/streams.h"

namespace esim {
namespace {

TEST(IntervalHistogram, EveryIntervalIsBetweenTheEdgesOfItsBin) {
  std::mt19937_64 random(1);
  std::vector<TimeNs> intervals;
  for (int bin = 0; bin <= IntervalHistogram::kBins; ++bin) {
    const auto edge = static_cast<TimeNs>(std::llround(1e9 * IntervalHistogram::edge_s(bin)));
    for (TimeNs near = -2; near <= 2; ++near) intervals.push_back(edge + near);
  }
  std::uniform_real_distribution<double> exponent(0, 12.5);
  for (int i = 0; i < 20'000; ++i) intervals.push_back(static_cast<TimeNs>(std::pow(10.0, exponent(random))));
  for (const TimeNs interval : intervals) {
    IntervalHistogram histogram;
    histogram.add(interval);
    EXPECT_EQ(histogram.total(), 1u);
    EXPECT_EQ(histogram.below(), interval < 1'000 ? 1u : 0u) << interval;
    EXPECT_EQ(histogram.above(), interval >= 100 * kNsPerSecond ? 1u : 0u) << interval;
    for (int bin = 0; bin < IntervalHistogram::kBins; ++bin) {
      if (histogram.bins()[static_cast<std::size_t>(bin)] == 0) continue;
      EXPECT_GE(to_seconds(interval), IntervalHistogram::edge_s(bin) * (1 - 1e-9));
      EXPECT_LT(to_seconds(interval), IntervalHistogram::edge_s(bin + 1) * (1 + 1e-9));
    }
  }
}

TEST(IntervalHistogram, WholeMicrosecondsShowNoComb) {
  // Equal numbers of intervals for each whole us: every bar has the same density, even if it spans few us.
  IntervalHistogram whole, finer;
  constexpr int kLongest_us = 3000;
  for (int us = 1; us < kLongest_us; ++us) whole.add(us * kNsPerUs);
  for (int i = 4; i < 4 * kLongest_us; ++i) finer.add(i * kNsPerUs / 4);
  const std::vector<double> bars = whole.bars(2);
  double all = 0;
  for (int bar = 0; IntervalHistogram::edge_s(2 * bar + 2) < 1e-6 * kLongest_us; ++bar) {
    const double width_us = 1e6 * (IntervalHistogram::edge_s(2 * bar + 2) - IntervalHistogram::edge_s(2 * bar));
    EXPECT_NEAR(bars[static_cast<std::size_t>(bar)] * (kLongest_us - 1) / width_us, 1, 1e-9) << bar;
    all += bars[static_cast<std::size_t>(bar)];
  }
  EXPECT_NEAR(all, IntervalHistogram::edge_s(2 * 69) / (1e-6 * kLongest_us), 1e-3);
  // Intervals finer than a us are not spread.
  EXPECT_NEAR(finer.bars(2)[6], 1.0 / static_cast<double>(finer.total()), 1e-12);  // 1.995 to 2.24 us: 2 us alone
}

TEST(IntervalHistogram, QuantilesAreThoseOfTheSortedIntervals) {
  std::mt19937_64 random(2);
  std::lognormal_distribution<double> seconds(std::log(3e-3), 1.5);
  IntervalHistogram histogram;
  std::vector<double> all;
  for (int i = 0; i < 100'000; ++i) {
    all.push_back(seconds(random));
    histogram.add(to_ns(all.back()));
  }
  std::sort(all.begin(), all.end());
  for (const double fraction : {0.01, 0.25, 0.5, 0.9, 0.99}) {
    const double exact = all[static_cast<std::size_t>(fraction * static_cast<double>(all.size()))];
    EXPECT_NEAR(histogram.quantile_s(fraction), exact, 0.01 * exact) << fraction;
  }
  EXPECT_EQ(histogram.shortest(), to_ns(all.front()));
  EXPECT_EQ(histogram.longest(), to_ns(all.back()));
  EXPECT_NEAR(histogram.quantile_s(0), all.front(), 1e-9);
  EXPECT_NEAR(histogram.quantile_s(1), all.back(), 1e-9);
  EXPECT_TRUE(std::isnan(IntervalHistogram().quantile_s(0.5)));
}

// Compares with windows of 1 ms by brute force, with pauses of all lengths, so that the curve's bins grow.
TEST(RateCurve, CountsWindows) {
  std::mt19937_64 random(3);
  for (const double pause_s : {1e-4, 1e-3, 0.01, 1.0}) {
    RateCurve curve;
    std::map<std::int64_t, std::uint64_t> windows;
    std::uint64_t on = 0;
    std::exponential_distribution<double> wait(1 / pause_s);
    TimeNs t = 0;
    for (int i = 0; i < 20'000; ++i) {
      curve.add(t, i % 3 == 0);
      on += i % 3 == 0 ? 1 : 0;
      ++windows[t / kNsPerMs];
      t += to_ns(random() % 4 == 0 ? wait(random) : 1e-5);
    }
    curve.finish();
    std::uint64_t max_in_1 = 0, max_in_10 = 0;
    for (const auto& [ms, events] : windows) {
      max_in_1 = std::max(max_in_1, events);
      std::uint64_t sum = 0;
      for (auto it = windows.lower_bound(ms - 9); it != windows.end() && it->first <= ms; ++it) sum += it->second;
      max_in_10 = std::max(max_in_10, sum);
    }
    EXPECT_EQ(curve.max_in_1_ms(), max_in_1);
    EXPECT_EQ(curve.max_in_10_ms(), max_in_10);

    std::vector<std::uint64_t> expected(curve.bins().size());
    for (const auto& [ms, events] : windows)
      expected.at(static_cast<std::size_t>(ms * kNsPerMs / curve.bin_width())) += events;
    std::uint64_t sum_on = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(curve.bins()[i].on + curve.bins()[i].off, expected[i]);
      sum_on += curve.bins()[i].on;
    }
    EXPECT_EQ(sum_on, on);
    EXPECT_LE(expected.size(), RateCurve::kMaxBins);
    EXPECT_TRUE(curve.bin_width() == kNsPerMs || expected.size() > RateCurve::kMaxBins / 2);
  }
}

TEST(TimeSample, KeepsAllOfFewAndAnEvenPartOfMany) {
  TimeSample few, many;
  for (TimeNs t = 0; t < 1000; ++t) few.add(t);
  EXPECT_EQ(few.items().size(), 1000u);

  constexpr TimeNs kMany = 5'000'000;
  for (TimeNs t = 0; t < kMany; ++t) many.add(t);
  const auto& times = many.items();
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_NEAR(static_cast<double>(times.size()), kMany / 8.0, 4000);
  for (const TimeNs period : {2, 3, 64, 1000}) {
    const auto even = std::count_if(times.begin(), times.end(), [&](TimeNs t) { return t % period == 0; });
    const double expected = static_cast<double>(times.size()) / static_cast<double>(period);
    EXPECT_NEAR(static_cast<double>(even), expected, 5 * std::sqrt(expected)) << period;
  }
}

}  // namespace
}  // namespace esim
