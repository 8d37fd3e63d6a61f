// Statistics that distinguish sensors, on streams for which they are known.
#include "esim/stats/sensor/sensor_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "stats/streams.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kWidth = 40, kHeight = 30;

SensorStatistics statistics_of(const std::vector<Event>& events,
                               std::optional<SensorSize> sensor = SensorSize{kWidth, kHeight},
                               std::size_t portion = 1000) {
  SensorStatisticsCounter counter(sensor);
  for (std::size_t i = 0; i < events.size(); i += portion)
    counter.add(std::span(events).subspan(i, std::min(portion, events.size() - i)));
  return std::move(counter).finish();
}

std::vector<Event> poisson_events(double rate_hz, double duration_s, unsigned seed) {
  return test::events_at(test::poisson_times(rate_hz, duration_s, seed), kWidth, kHeight, seed + 1);
}

Event event_at(std::int64_t us, int x, int y, int polarity) {
  return {us * kNsPerUs, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
          static_cast<std::int8_t>(polarity)};
}

TEST(SensorStatistics, OfPoissonEventsAreThoseOfChance) {
  constexpr double kRate = 1e6, kDuration = 2, kPixels = kWidth * kHeight;
  const SensorStatistics s = statistics_of(poisson_events(kRate, kDuration, 1));
  EXPECT_NEAR(s.on_fraction(), 0.5, 0.002);
  EXPECT_NEAR(s.alike_fraction(), 0.5, 0.002);
  // Each ratio has a relative standard error of 1 / sqrt(pairs / places): 6e-3 for rows at the same us.
  EXPECT_NEAR(s.same_us.row_over_chance(kHeight), 1, 0.03);
  EXPECT_NEAR(s.same_us.column_over_chance(kWidth), 1, 0.03);
  EXPECT_NEAR(s.after.row_over_chance(kHeight), 1, 0.01);
  EXPECT_NEAR(s.after.column_over_chance(kWidth), 1, 0.01);
  EXPECT_NEAR(s.fano[0].factor(), 1, 5 * std::sqrt(2 / 2e4));
  EXPECT_NEAR(s.fano[1].factor(), 1, 5 * std::sqrt(2 / 2e3));
  // Exponential intervals: the quantile p is -mean ln(1 - p).
  const double mean_us = 1e6 * kPixels / kRate;
  for (const double p : {0.01, 0.1, 0.5, 0.9})
    EXPECT_NEAR(s.intervals_us.quantile(p) / (-mean_us * std::log1p(-p)), 1, 0.03) << p;
  EXPECT_NEAR(s.intervals_us.fraction_below(100), -std::expm1(-100 / mean_us), 0.001);
  // At 833 Hz, noise cannot be distinguished from motion; at 4 Hz it can.
  EXPECT_EQ(s.quiet.all.pixels, 0U);
  const SensorStatistics slow = statistics_of(poisson_events(4.0 * kPixels, 20, 3));
  EXPECT_GT(static_cast<double>(slow.quiet.all.pixels), 0.9 * kPixels);
  EXPECT_NEAR(slow.quiet.rate_hz() / 4, 1, 0.03);
  EXPECT_FALSE(s.scan);
}

TEST(SensorStatistics, EqualDefinitionsByBruteForce) {
  std::mt19937 random(4);
  std::vector<Event> events;
  std::int64_t us = 123'456;
  for (int i = 0; i < 20'000; ++i) {
    us += random() % 4 == 0 ? static_cast<std::int64_t>(random() % 40) : 0;
    events.push_back(event_at(us, static_cast<int>(random() % 7), static_cast<int>(random() % 5), random() % 3 == 0));
  }
  const SensorStatistics s = statistics_of(events, SensorSize{7, 5}, 77);
  double same = 0, same_row = 0, same_column = 0, after = 0, after_row = 0;
  std::map<std::pair<int, int>, std::vector<Event>> of_pixel;
  std::vector<double> counts(static_cast<std::size_t>((us - 123'456) / 100 + 1));
  for (std::size_t i = 0; i < events.size(); ++i) {
    of_pixel[{events[i].x, events[i].y}].push_back(events[i]);
    counts[static_cast<std::size_t>((events[i].t / kNsPerUs - 123'456) / 100)] += 1;
    for (std::size_t k = 1; k < 200 && i + k < events.size(); ++k) {
      const TimeNs gap = (events[i + k].t - events[i].t) / kNsPerUs;
      if (gap > 5) continue;
      (gap == 0 ? same : after) += 1;
      (gap == 0 ? same_row : after_row) += events[i + k].y == events[i].y;
      if (gap == 0) same_column += events[i + k].x == events[i].x;
    }
  }
  std::vector<double> intervals;
  double alike = 0;
  for (const auto& [pixel, own] : of_pixel) {
    for (std::size_t i = 1; i < own.size(); ++i) {
      intervals.push_back(static_cast<double>((own[i].t - own[i - 1].t) / kNsPerUs));
      alike += (own[i].polarity > 0) == (own[i - 1].polarity > 0);
    }
  }
  std::sort(intervals.begin(), intervals.end());
  counts.pop_back();
  double mean = 0, variance = 0;
  for (const double count : counts) mean += count / static_cast<double>(counts.size());
  for (const double count : counts) variance += (count - mean) * (count - mean) / static_cast<double>(counts.size());
  EXPECT_DOUBLE_EQ(s.same_us.row_over_chance(5), same_row / same * 5);
  EXPECT_DOUBLE_EQ(s.same_us.column_over_chance(7), same_column / same * 7);
  EXPECT_DOUBLE_EQ(s.after.row_over_chance(5), after_row / after * 5);
  EXPECT_NEAR(s.fano[0].factor(), variance / mean, 1e-9);
  EXPECT_DOUBLE_EQ(s.alike_fraction(), alike / static_cast<double>(intervals.size()));
  for (const double p : {0.0, 0.01, 0.1, 0.5, 1.0}) {
    const double place = p * static_cast<double>(intervals.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const double next = intervals[std::min(low + 1, intervals.size() - 1)];
    const double expected = intervals[low] + (place - std::floor(place)) * (next - intervals[low]);
    EXPECT_NEAR(s.intervals_us.quantile(p), expected, expected < 2000 ? 1e-9 : 1e-3 * expected);
  }
}

TEST(SensorStatistics, DoNotDependOnPortionsNorOnAKnownSize) {
  std::vector<Event> events = poisson_events(1e5, 0.3, 7);
  events.push_back(event_at(400'000, kWidth - 1, kHeight - 1, 1));
  const auto expected = values_of(statistics_of(events));
  for (const auto& other :
       {statistics_of(events, SensorSize{kWidth, kHeight}, 1), statistics_of(events, std::nullopt)}) {
    const auto values = values_of(other);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (!std::isnan(expected[i].value)) {
        EXPECT_EQ(values[i].value, expected[i].value) << expected[i].name;
      }
    }
  }
}

TEST(SensorStatistics, OfHardlyAnyEventsAreUndefined) {
  for (const std::vector<Event>& events : {std::vector<Event>{}, {event_at(5, 3, 4, 1)}}) {
    const SensorStatistics s = statistics_of(events);
    EXPECT_EQ(s.events, events.size());
    for (const NamedValue& value : values_of(s)) {
      const bool of_one = value.name == "ON fraction" || value.name == "events per time stamp" ||
                          value.name == "correlation of neighbouring pixels";
      const bool defined = of_one && !events.empty();
      EXPECT_EQ(std::isnan(value.value), !defined) << value.name;
    }
  }
}

TEST(SensorStatistics, OfOnePixelAreThoseOfThatPixel) {
  std::vector<Event> events;
  for (int i = 0; i <= 10'000; ++i) events.push_back(event_at(50 * i, 3, 4, i % 2 == 0 ? 1 : -1));
  const SensorStatistics s = statistics_of(events);
  EXPECT_EQ(s.alike_fraction(), 0);
  EXPECT_EQ(s.intervals_us.quantile(0.5), 50);
  EXPECT_EQ(s.intervals_us.fraction_below(100), 1);
  EXPECT_EQ(s.intervals_us.fraction_below(50), 0);
  EXPECT_EQ(s.fano[0].factor(), 0);
  EXPECT_TRUE(std::isnan(s.same_us.row_over_chance(kHeight)));
  EXPECT_EQ(s.counts_on.bins()[0], kWidth * kHeight - 1U);
  EXPECT_NEAR(s.quiet.rate_hz(), 10'001 / 0.5 / (kWidth * kHeight), 1e-6);
}

TEST(SensorStatistics, RefuseEventsOutOfOrderOrOutsideTheSensor) {
  EXPECT_THROW(statistics_of({event_at(5, 0, 0, 1), event_at(4, 0, 0, 1)}), InternalError);
  EXPECT_THROW(statistics_of({event_at(5, kWidth, 0, 1)}), InternalError);
  EXPECT_THROW(SensorStatisticsCounter(SensorSize{60'000, 60'000}), UserError);
}

TEST(SensorStatistics, SeeRowsThatAreReadTogetherAndThenRest) {
  std::mt19937 random(2);
  std::vector<Event> events;
  for (int i = 0; i < 5000; ++i) {
    const int row = i % kHeight;  // a row is next read after 30 others
    for (int k = 0; k < 4; ++k) events.push_back(event_at(2 * i, static_cast<int>(random() % kWidth), row, 1));
  }
  std::sort(events.begin(), events.end());
  const SensorStatistics s = statistics_of(events);
  EXPECT_EQ(s.same_us.row_over_chance(kHeight), kHeight);
  EXPECT_EQ(s.after.row_over_chance(kHeight), 0);
}

/// Each row is read a random time after its first event, at which its events get one time stamp.
std::vector<Event> read_by_rows(const std::vector<Event>& events, double least_us, double most_us) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> wait_us(least_us, most_us);
  std::vector<TimeNs> read_at(kHeight, -1);
  std::vector<Event> read;
  for (const Event& event : events) {
    TimeNs& t = read_at[event.y];
    if (event.t > t) t = event.t + static_cast<TimeNs>(1000 * wait_us(random));
    read.push_back({(t / kNsPerUs + 1) * kNsPerUs, event.x, event.y, event.polarity});
  }
  std::sort(read.begin(), read.end());
  return read;
}

TEST(SensorStatistics, CountPairsOfRowsAsByBruteForce) {
  std::mt19937 random(8);
  std::vector<std::pair<std::int64_t, std::uint16_t>> events;
  for (std::int64_t t = 0; events.size() < 3000; t += random() % 3)
    events.emplace_back(t, static_cast<std::uint16_t>(random() % 5));
  RowPairs pairs;
  std::array<std::uint64_t, RowPairs::kLongest_us> expected{};
  for (std::size_t i = 0; i < events.size(); ++i) {
    const auto& [t, row] = events[i];
    pairs.add(t, row);
    for (std::size_t j = 0; j < i; ++j) {
      const std::int64_t distance = t - events[j].first;
      if (events[j].second == row && distance >= 1 && distance <= 128)
        ++expected[static_cast<std::size_t>(distance - 1)];
    }
  }
  EXPECT_EQ(pairs.counts(), expected);

  RowPairs same;  // a million events of one time stamp do not take forever
  for (int i = 0; i < 1'000'000; ++i) same.add(5, 3);
  same.add(7, 3);
  EXPECT_EQ(same.counts()[1], 1'000'000U);
}

TEST(SensorStatistics, FindHowLongRowsWait) {
  // Of the pairs that a wait w hides, the events that have joined a reading hide a few themselves: w (1 - rate w / 2).
  constexpr double kFound_us = 8 * (1 - 2e5 / kHeight * 8e-6 / 2);
  int inside = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const std::vector<Event> events = poisson_events(2e5, 0.5, 100 + seed);
    const RowPairs::Wait wait = statistics_of(read_by_rows(events, 4, 12)).row_wait;
    EXPECT_NEAR(wait.mean_us, 8, 2);
    inside += std::abs(wait.mean_us - kFound_us) < 2 * wait.deviation_us ? 1 : 0;
  }
  EXPECT_GE(inside, 33);  // 38 of 40 for normal errors; 2 % of 40 binomials are below 35

  const RowPairs::Wait none = statistics_of(poisson_events(2e5, 0.5, 9)).row_wait;
  EXPECT_LT(std::abs(none.mean_us), 4 * none.deviation_us);
  EXPECT_TRUE(std::isnan(statistics_of(poisson_events(1e3, 0.5, 9)).row_wait.mean_us));
  EXPECT_TRUE(std::isnan(statistics_of(read_by_rows(poisson_events(2e5, 0.5, 9), 60, 90)).row_wait.mean_us));
}

TEST(SensorStatistics, FindTheNoiseBesideMotion) {
  // An edge crosses columns 0 to 15 again and again; all pixels fire at 2 Hz.
  constexpr double kDuration = 10;
  std::vector<Event> events = poisson_events(2.0 * kWidth * kHeight, kDuration, 3);
  for (int pass = 0; pass < 100; ++pass) {
    for (int x = 0; x < 16; ++x) {
      for (int y = 0; y < kHeight; ++y) events.push_back(event_at(100'000 * pass + 1000 * x + y, x, y, 1));
    }
  }
  std::sort(events.begin(), events.end());
  const SensorStatistics s = statistics_of(events);
  EXPECT_EQ(s.quiet.all.pixels, 16U * kHeight);  // without the blocks next to the motion
  EXPECT_NEAR(s.quiet.rate_hz(), 2, 5 * std::sqrt(2 / (16.0 * kHeight * kDuration)));
}

TEST(SensorStatistics, FindScansAndTheirPhases) {
  constexpr double kPeriod_us = 197.3;
  for (const double jitter : {0.0, 0.1}) {  // standard deviation, in periods
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    std::vector<Event> events;
    for (Event event : poisson_events(1e5, 2, 5)) {
      const double turn = static_cast<double>(event.x) / kWidth;
      const double scan = std::ceil(static_cast<double>(event.t) * 1e-3 / kPeriod_us - turn);
      const double us = kPeriod_us * (scan + turn + jitter * normal(random));
      event.t = std::max<std::int64_t>(0, std::llround(us)) * kNsPerUs;
      events.push_back(event);
    }
    std::sort(events.begin(), events.end());
    const SensorStatistics s = statistics_of(events);
    ASSERT_TRUE(s.scan) << jitter;
    EXPECT_NEAR(s.scan->period_s * 1e6 / kPeriod_us, 1, 2e-6);
    // The mean of exp(i phase) of a normal phase.
    EXPECT_NEAR(s.scan->concentration, std::exp(-2 * std::pow(M_PI * jitter, 2)), 0.003);
    for (std::size_t x = 1; x < kWidth; ++x) {
      const double step = s.scan->column_phases[x] - s.scan->column_phases[x - 1];
      EXPECT_NEAR(std::remainder(step - 1.0 / kWidth, 1.0), 0, 0.03) << x;
    }
  }
}

TEST(SensorStatistics, AreTheSumsOfBlocksAndOfTiles) {
  const std::vector<Event> events = poisson_events(1e5, 3, 11);
  const SensorStatistics s = statistics_of(events);
  EXPECT_EQ(s.block_s, 0.128);  // the smallest power of 2 ms of which at most 32 are needed
  ASSERT_EQ(s.blocks.size(), 24U);
  std::vector<std::uint64_t> expected(24);
  for (const Event& event : events) ++expected[static_cast<std::size_t>((event.t - events[0].t + 500) / 128'000'000)];
  StreamSums sums;
  for (std::size_t i = 0; i < s.blocks.size(); ++i) {
    EXPECT_EQ(s.blocks[i].events, expected[i]) << i;
    sums.add(s.blocks[i]);
  }
  EXPECT_EQ(sums.events, events.size());
  EXPECT_EQ(sums.intervals_us.quantile(0.3), s.intervals_us.quantile(0.3));
  EXPECT_EQ(sums.pairs, s.pairs);
  ASSERT_EQ(s.tiles.size(), 64U);
  PixelSums pixels;
  for (const PixelSums& tile : s.tiles) pixels.add(tile);
  EXPECT_EQ(pixels.counts_on.total(), static_cast<std::uint64_t>(kWidth * kHeight));
  EXPECT_EQ(ks_distance(pixels.counts_off, s.counts_off), 0);
}

TEST(SensorStatistics, KnowTimeStampsAndNeighbours) {
  std::vector<Event> events;
  for (int i = 0; i < 1000; ++i) {
    const int x = i * 7 % kWidth;
    for (int k = 0; k < x; ++k) events.push_back(event_at(6 * i + 4 * (k % 2), x, i % kHeight, 1));
  }
  std::sort(events.begin(), events.end());
  const SensorStatistics s = statistics_of(events);
  EXPECT_EQ(s.stamp_unit, 2 * kNsPerUs);
  std::set<TimeNs> stamps;
  std::map<std::pair<int, int>, double> counts;
  for (const Event& event : events) stamps.insert(event.t), ++counts[{event.x, event.y}];
  EXPECT_EQ(s.stamps, stamps.size());
  std::vector<double> a, b;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (x + 1 < kWidth) a.push_back(counts[{x, y}]), b.push_back(counts[{x + 1, y}]);
      if (y + 1 < kHeight) a.push_back(counts[{x, y}]), b.push_back(counts[{x, y + 1}]);
    }
  }
  const auto mean = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  };
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double da = a[i] - mean(a), db = b[i] - mean(b);
    ab += da * db, aa += da * da, bb += db * db;
  }
  EXPECT_NEAR(s.neighbours.value(), ab / std::sqrt(aa * bb), 1e-9);
}

TEST(IntegerHistogram, HasQuantilesOfValuesOfAnySize) {
  IntegerHistogram histogram;
  std::vector<double> values;
  std::mt19937_64 random(1);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t value = random() >> (random() % 64);
    histogram.add(value);
    values.push_back(static_cast<double>(value));
  }
  std::sort(values.begin(), values.end());
  for (std::size_t i = 0; i < values.size(); i += 101) {
    const double quantile = histogram.quantile(static_cast<double>(i) / static_cast<double>(values.size() - 1));
    EXPECT_NEAR(quantile, values[i], values[i] < 2000 ? 1e-6 * (1 + values[i]) : 1.1e-3 * values[i]);
  }
  for (std::size_t bin = 0; bin + 1 < histogram.bins().size(); ++bin)
    ASSERT_LT(IntegerHistogram::edge(bin), IntegerHistogram::edge(bin + 1));
  EXPECT_TRUE(std::isnan(IntegerHistogram{}.quantile(0.5)));
}

TEST(KsDistance, EqualsThatOfSortedValues) {
  IntegerHistogram low, high, both;
  for (std::uint64_t value : {0, 1, 2, 3}) low.add(value), both.add(value);
  for (std::uint64_t value : {100'000, 200'000}) high.add(value), both.add(value);
  EXPECT_EQ(ks_distance(low, high), 1);
  EXPECT_NEAR(ks_distance(low, both), 1.0 / 3, 1e-15);
  EXPECT_NEAR(ks_distance(both, high), 2.0 / 3, 1e-15);
}

}  // namespace
}  // namespace esim
