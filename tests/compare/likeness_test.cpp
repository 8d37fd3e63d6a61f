// How alike sensors are, on streams whose statistics are known.
#include "esim/compare/likeness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "esim/compare/comparison_text.h"

namespace esim {
namespace {

constexpr int kWidth = 48, kHeight = 32;

struct Stream {
  double rate_hz = 2e5, on = 0.5;
  double burst_period_s = 0;  ///< the rate is modulated with this period
  TimeNs stamp = 1000;        ///< unit of the time stamps
  double duration_s = 1;
};

SensorStatistics statistics_of(const Stream& stream, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::exponential_distribution<double> wait(2 * stream.rate_hz);
  SensorStatisticsCounter counter(SensorSize{kWidth, kHeight});
  std::vector<Event> events;
  for (double t = wait(random); t < stream.duration_s; t += wait(random)) {
    const double phase = stream.burst_period_s > 0 ? std::sin(2 * M_PI * t / stream.burst_period_s) : 0;
    if (unit(random) > 0.5 * (1 + phase)) continue;
    events.push_back({to_ns(t) / stream.stamp * stream.stamp, static_cast<std::uint16_t>(random() % kWidth),
                      static_cast<std::uint16_t>(random() % kHeight),
                      static_cast<std::int8_t>(unit(random) < stream.on ? 1 : -1)});
  }
  std::sort(events.begin(), events.end());
  counter.add(events);
  return std::move(counter).finish();
}

std::vector<std::string> differing(const std::vector<ComparedStatistic>& statistics) {
  std::vector<std::string> names;
  for (const ComparedStatistic* statistic : distinguishing(statistics)) names.push_back(statistic->name);
  return names;
}

const ComparedStatistic& find(const std::vector<ComparedStatistic>& statistics, const std::string& name) {
  for (const ComparedStatistic& statistic : statistics) {
    if (statistic.name == name) return statistic;
  }
  throw std::runtime_error("no statistic is called " + name);
}

TEST(CompareSensors, EqualSensorsAreSeldomDistinguished) {
  int told_apart = 0, outside = 0, intervals = 0;
  for (unsigned trial = 0; trial < 40; ++trial) {
    const auto compared = compare_sensors(statistics_of({}, 2 * trial), statistics_of({}, 2 * trial + 1));
    told_apart += differing(compared).empty() ? 0 : 1;
    for (const ComparedStatistic& s : compared) {
      if (s.kind == ComparedStatistic::Kind::distribution || std::isnan(s.low)) continue;
      const double equal = s.kind == ComparedStatistic::Kind::ratio ? 1 : 0;
      ++intervals;
      outside += s.low > equal || s.high < equal ? 1 : 0;
    }
  }
  EXPECT_LE(told_apart, 5);
  // 95 % intervals, from about 20 blocks: somewhat too narrow.
  EXPECT_GT(outside, intervals / 100);
  EXPECT_LT(outside, intervals / 10);
}

TEST(CompareSensors, FindsWhatDiffers) {
  const SensorStatistics usual = statistics_of({}, 1);
  const auto alike = [&](const Stream& stream, unsigned seed) {
    return differing(compare_sensors(usual, statistics_of(stream, seed)));
  };
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  Stream more;
  more.on = 0.55;
  EXPECT_EQ(alike(more, 2).front(), "ON fraction");
  Stream faster;
  faster.rate_hz = 2.2e5;
  const auto rates = alike(faster, 3);
  EXPECT_TRUE(has(rates, "events per second") && has(rates, "intervals") && !has(rates, "ON fraction"));
  Stream bursts;
  bursts.burst_period_s = 1e-3;
  const auto fano = alike(bursts, 4);
  EXPECT_TRUE(has(fano, "Fano factor, 100 us") && !has(fano, "events per second"));
  Stream coarse;
  coarse.stamp = 10'000;
  EXPECT_TRUE(has(alike(coarse, 5), "unit of time stamps"));
}

TEST(CompareSensors, GivesDistancesAndIntervals) {
  Stream faster, more;
  faster.rate_hz = 3e5;
  more.on = 0.6;
  const SensorStatistics usual = statistics_of({}, 1);
  const ComparedStatistic rate = find(compare_sensors(usual, statistics_of(faster, 2)), "events per second");
  EXPECT_NEAR(rate.distance, 1.5, 0.02);
  EXPECT_LT(rate.low, rate.distance);
  EXPECT_GT(rate.high, rate.distance);
  // Of Poisson counts n and 1.5 n: the logarithm has the variance 1 / n + 1 / (1.5 n).
  const double deviation = std::sqrt((1 + 1 / 1.5) / 2e5);
  EXPECT_NEAR(std::log(rate.high / rate.low) / (2 * 1.96 * deviation), 1, 0.35);
  const ComparedStatistic on = find(compare_sensors(usual, statistics_of(more, 3)), "ON fraction");
  EXPECT_NEAR(on.distance, 0.1, 0.005);
  EXPECT_NEAR((on.high - on.low) / (2 * 1.96 * std::sqrt((0.25 + 0.24) / 2e5)), 1, 0.35);
}

TEST(CompareSensors, SaysNothingAboutShortRecordings) {
  Stream few;
  few.rate_hz = 5;
  const SensorStatistics s = statistics_of(few, 1);
  for (const SensorStatistics& other : {s, statistics_of({}, 2), SensorStatistics{}}) {
    for (const ComparedStatistic& statistic : compare_sensors(s, other)) {
      if (statistic.name.find("of a pixel") == std::string::npos) {
        EXPECT_TRUE(std::isnan(statistic.deviations)) << statistic.name;
      }
    }
  }
  RecordingComparison nothing;
  nothing.statistics = compare_sensors({}, {});
  EXPECT_NE(describe(nothing).find("too few events to tell"), std::string::npos);
  EXPECT_NE(to_json(nothing).find("\"deviations\": null"), std::string::npos);
}

TEST(CompareSensors, DoesNotDependOnChance) {
  const SensorStatistics a = statistics_of({}, 1), b = statistics_of({}, 2);
  const auto once = compare_sensors(a, b), again = compare_sensors(a, b);
  for (std::size_t i = 0; i < once.size(); ++i) {
    if (std::isnan(once[i].deviations)) continue;
    EXPECT_EQ(once[i].deviations, again[i].deviations);
    EXPECT_EQ(once[i].low, again[i].low);
  }
}

}  // namespace
}  // namespace esim
