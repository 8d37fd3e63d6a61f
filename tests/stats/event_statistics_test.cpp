#include "esim/stats/event_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "esim/core/error.h"
#include "esim/stats/figure.h"
#include "esim/stats/statistics_text.h"
#include "stats/streams.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

constexpr int kWidth = 40, kHeight = 30;

Statistics statistics_of(const std::vector<Event>& events, const StatisticsOptions& options = {},
                         std::optional<SensorSize> sensor = SensorSize{kWidth, kHeight}) {
  EventStatistics statistics(sensor);
  statistics.add(events);
  return std::move(statistics).finish(options);
}

TEST(EventStatistics, EqualsBruteForce) {
  std::vector<TimeNs> times = test::poisson_times(2e5, 0.5, 1);
  for (TimeNs& t : times) t -= t % kNsPerUs;  // some are simultaneous
  const auto events = test::events_at(times, kWidth, kHeight, 2);
  const Statistics s = statistics_of(events);

  std::map<TimeNs, std::uint64_t> at;
  std::map<std::pair<int, int>, std::vector<TimeNs>> of_pixel;
  std::uint64_t on = 0;
  for (const Event& event : events) {
    ++at[event.t];
    of_pixel[{event.x, event.y}].push_back(event.t);
    on += event.polarity > 0 ? 1 : 0;
  }
  std::uint64_t simultaneous = 0, max = 0, intervals = 0;
  for (const auto& [t, number] : at) {
    simultaneous += number > 1 ? number : 0;
    max = std::max(max, number);
  }
  TimeNs shortest = kNsPerSecond;
  std::vector<double> all;
  for (const auto& [pixel, stamps] : of_pixel) {
    EXPECT_EQ(s.counts(pixel.first, pixel.second), stamps.size());
    for (std::size_t i = 1; i < stamps.size(); ++i, ++intervals) {
      shortest = std::min(shortest, stamps[i] - stamps[i - 1]);
      all.push_back(to_seconds(stamps[i] - stamps[i - 1]));
    }
  }
  EXPECT_EQ(s.events(), events.size());
  EXPECT_EQ(s.on, on);
  EXPECT_EQ(s.first, events.front().t);
  EXPECT_EQ(s.last, events.back().t);
  EXPECT_EQ(s.distinct_times, at.size());
  EXPECT_EQ(s.simultaneous, simultaneous);
  EXPECT_EQ(s.max_simultaneous, max);
  EXPECT_EQ(s.intervals.total(), intervals);
  EXPECT_EQ(s.intervals.shortest(), shortest);
  EXPECT_EQ(s.silent_pixels, kWidth * kHeight - of_pixel.size());
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  EXPECT_NEAR(s.intervals.quantile_s(0.5), all[all.size() / 2], 0.02 * all[all.size() / 2]);
}

// Rate r of each pixel: intervals are exponential, with median ln 2 / r and quantiles -ln(1 - q) / r.
TEST(EventStatistics, PoissonStreamOfKnownRate) {
  constexpr double kRate = 100 * kWidth * kHeight;
  const Statistics s = statistics_of(test::events_at(test::poisson_times(kRate, 4, 3), kWidth, kHeight, 4));
  EXPECT_NEAR(s.mean_rate_hz(), kRate, 5 * std::sqrt(kRate / 4));
  EXPECT_NEAR(s.intervals.quantile_s(0.5), std::log(2.0) / 100, 2e-4);
  EXPECT_NEAR(s.intervals.quantile_s(0.01), -std::log(0.99) / 100, 1e-5);
  EXPECT_NEAR(s.median_count, 400, 5);
  EXPECT_TRUE(s.hot_pixels.empty());
  EXPECT_EQ(s.banding(), Banding::none);
  EXPECT_LT(static_cast<double>(s.rate.max_in_10_ms()), kRate * 0.01 + 6 * std::sqrt(kRate * 0.01));
  EXPECT_GT(static_cast<double>(s.rate.max_in_1_ms()), kRate * 0.001);
}

TEST(EventStatistics, PortionsDoNotMatter) {
  const auto events = test::events_at(test::banded(test::poisson_times(1e6, 1.5, 5), 100, 2), kWidth, kHeight, 6);
  const std::string whole = to_json({"", statistics_of(events)});
  std::mt19937 random(7);
  EventStatistics statistics(SensorSize{kWidth, kHeight});
  for (std::size_t done = 0; done < events.size();) {
    const std::size_t count = std::min<std::size_t>(random() % 5000, events.size() - done);
    statistics.add(EventSpan(events).subspan(done, count));
    done += count;
  }
  EXPECT_EQ(to_json({"", std::move(statistics).finish()}), whole);
}

TEST(EventStatistics, BandsOfAGivenAndOfAnUnknownPeriod) {
  const auto events = test::events_at(test::banded(test::poisson_times(5e4, 2, 8), 50, 4), kWidth, kHeight, 9);
  StatisticsOptions options;
  options.frame_rate_hz = 50;
  EXPECT_EQ(statistics_of(events, options).banding(), Banding::strong);
  EXPECT_TRUE(contains(verdict(statistics_of(events, options)), "banding at the frame times"));
  const Statistics searched = statistics_of(events);
  EXPECT_EQ(searched.banding(), Banding::strong);
  EXPECT_NEAR(searched.periodicity->frequency_hz, 200, 0.01);
}

TEST(EventStatistics, AnUnknownSensorGrows) {
  auto events = test::events_at(test::poisson_times(1e4, 1, 1), kWidth, kHeight, 2);
  events.front().x = 3;
  const Statistics known = statistics_of(events), grown = statistics_of(events, {}, std::nullopt);
  EXPECT_EQ(grown.sensor.width, kWidth);
  EXPECT_EQ(grown.sensor.height, kHeight);
  EXPECT_EQ(to_json({"", known}), to_json({"", grown}));
  EXPECT_TRUE(contains(message_of<UserError>([] {
                         statistics_of({{0, 65535, 65535, 1}}, {}, std::nullopt);
                       }),
                       "65536"));
  EXPECT_TRUE(contains(message_of<UserError>([] { EventStatistics(SensorSize{65536, 65536}); }), "too large"));
}

TEST(EventStatistics, BrokenContracts) {
  EXPECT_NE(message_of<InternalError>([] { statistics_of({{5, 0, 0, 1}, {4, 0, 0, 1}}); }), "nothing was thrown");
  EXPECT_NE(message_of<InternalError>([] { statistics_of({{5, kWidth, 0, 1}}); }), "nothing was thrown");
}

// No events, one event, simultaneous events and negative times: text, JSON and figure must all work.
TEST(EventStatistics, DegenerateStreams) {
  const std::vector<std::vector<Event>> streams = {{},
                                                   {{7, 1, 2, 1}},
                                                   std::vector<Event>(300, Event{kNsPerSecond, 3, 4, -1}),
                                                   {{-5'000'000'000, 0, 0, 1}, {0, 0, 0, 1}}};
  for (const auto& events : streams) {
    for (const auto& sensor : {std::optional<SensorSize>(), std::optional(SensorSize{kWidth, kHeight})}) {
      for (const auto frame_rate_hz : {std::optional<double>(), std::optional(30.0)}) {
        const NamedStatistics file{"name", statistics_of(events, {5, frame_rate_hz}, sensor)};
        EXPECT_TRUE(contains(describe(std::span(&file, 1)), "too few events"));
        EXPECT_TRUE(contains(to_json(file), "\"banding\": \"unknown\""));
        EXPECT_EQ(draw_figure(file).width(), 1920);
      }
    }
  }
}

TEST(Report, TwoFilesSideBySide) {
  const std::vector<NamedStatistics> files = {
      {"first.h5", statistics_of(test::events_at(test::poisson_times(1e4, 1, 1), kWidth, kHeight, 2))},
      {"second.h5", statistics_of(test::events_at(test::poisson_times(3e6, 0.1, 1), kWidth, kHeight, 2))}};
  const std::string text = describe(files);
  EXPECT_TRUE(contains(text, "first.h5"));
  EXPECT_TRUE(contains(text, " kev/s"));
  EXPECT_TRUE(contains(text, " Mev/s"));
  EXPECT_TRUE(contains(text, ", corrected for ")) << "number of searched frequencies";
  for (const char* line : {"\n  events ", "\n  peak in 1 ms ", "\n  silent ", "\n  median ", "\n  verdict "}) {
    const std::size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << line;
    EXPECT_EQ(text.find(line, at + 1), std::string::npos) << line;
  }
}

TEST(Report, Numbers) {
  EXPECT_EQ(format_rate(0), "0.00 ev/s");
  EXPECT_EQ(format_rate(999.4), "999 ev/s");
  EXPECT_EQ(format_rate(999.6), "1.00 kev/s");
  EXPECT_EQ(format_rate(12'345'678), "12.3 Mev/s");
  EXPECT_EQ(format_duration(0), "0 ns");
  EXPECT_EQ(format_duration(1e-6), "1.00 us");
  EXPECT_EQ(format_duration(0.0333333), "33.3 ms");
  EXPECT_EQ(format_duration(1234.5), "1234 s");
}

}  // namespace
}  // namespace esim
