// Each filter against what OpenEB documents of its facility, and against slow definitions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "esim/core/error.h"
#include "esim/filters/activity_filter.h"
#include "esim/filters/anti_flicker_filter.h"
#include "esim/filters/chip_blocks.h"
#include "esim/filters/filter_chain.h"
#include "esim/filters/rate_controller.h"
#include "esim/filters/trail_filter.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

constexpr int kWidth = 24, kHeight = 16;
constexpr TimeNs kMs = 1'000'000;

/// Events at random pixels, `rate_hz` in all, from t = -10 ms on.
std::vector<Event> random_events(std::size_t count, double rate_hz, unsigned seed) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> gap(rate_hz);
  std::uniform_int_distribution<int> x(0, kWidth - 1), y(0, kHeight - 1), on(0, 1);
  std::vector<Event> events(count);
  double t_s = -0.01;
  for (Event& event : events) {
    t_s += gap(random);
    event = {static_cast<TimeNs>(std::llround(t_s * 1e9)), static_cast<std::uint16_t>(x(random)),
             static_cast<std::uint16_t>(y(random)), static_cast<std::int8_t>(on(random) != 0 ? 1 : -1)};
  }
  std::sort(events.begin(), events.end());
  return events;
}

std::vector<Event> passed(EventFilter& filter, EventSpan events) {
  std::vector<Event> out;
  filter.process(events, out);
  return out;
}

/// The events of both, in canonical order.
std::vector<Event> merged(std::vector<Event> a, const std::vector<Event>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end());
  return a;
}

// --- the event trail filter -----------------------------------------------------------------------------------------

/// The position of event i in its burst, by searching its pixel's earlier events.
int position_in_burst(const std::vector<Event>& events, std::size_t i, TimeNs threshold) {
  int position = 1;
  for (std::size_t k = i; k-- > 0;) {
    if (events[k].x != events[i].x || events[k].y != events[i].y) continue;
    if (events[k].polarity != events[i].polarity || events[i].t - events[k].t > threshold) break;
    ++position;
    i = k;
  }
  return position;
}

TEST(TrailFilter, KeepsThePositionsInABurstThatItsTypeNames) {
  const auto events = random_events(6000, 200'000, 3);
  for (const double threshold_us : {300.0, 3000.0, 20'000.0}) {
    for (const TrailType type : {TrailType::trail, TrailType::stc_cut_trail, TrailType::stc_keep_trail}) {
      std::vector<Event> expected;
      for (std::size_t i = 0; i < events.size(); ++i) {
        const int position = position_in_burst(events, i, static_cast<TimeNs>(threshold_us * 1e3));
        const bool keeps = type == TrailType::trail           ? position == 1
                           : type == TrailType::stc_cut_trail ? position == 2
                                                              : position > 1;
        if (keeps) expected.push_back(events[i]);
      }
      TrailFilter filter({type, threshold_us}, kWidth, kHeight);
      EXPECT_EQ(passed(filter, events), expected) << threshold_us;
      EXPECT_GT(expected.size(), 50u);
      EXPECT_LT(expected.size(), events.size() - 50);
    }
  }
}

TEST(TrailFilter, TrailAndKeepTrailTogetherAreAllEvents) {
  const auto events = random_events(3000, 50'000, 4);
  TrailFilter first({TrailType::trail, 5000}, kWidth, kHeight),
      later({TrailType::stc_keep_trail, 5000}, kWidth, kHeight);
  EXPECT_EQ(merged(passed(first, events), passed(later, events)), events);
}

// --- the anti-flicker filter ----------------------------------------------------------------------------------------

/// A block of 4 x 4 pixels under light of this frequency: all pixels report ON, half a period later OFF.
std::vector<Event> flicker(double hz, double duration_s, int x0, int y0) {
  std::vector<Event> events;
  for (int half = 0; half < static_cast<int>(2 * hz * duration_s); ++half) {
    for (int i = 0; i < 16; ++i) {
      const TimeNs t = std::llround(half * 0.5e9 / hz) + i * 1000;
      events.push_back({t, static_cast<std::uint16_t>(x0 + i % 4), static_cast<std::uint16_t>(y0 + i / 4),
                        static_cast<std::int8_t>(half % 2 == 0 ? 1 : -1)});
    }
  }
  return events;
}

double kept(const AntiFlickerOptions& options, double hz) {
  AntiFlickerFilter filter(options, kWidth, kHeight);
  const auto events = flicker(hz, 2.0, 8, 4);
  return static_cast<double>(passed(filter, events).size()) / static_cast<double>(events.size());
}

TEST(AntiFlickerFilter, DropsFrequenciesInTheBandAndNoOthers) {
  AntiFlickerOptions options;
  for (const double hz : {51.0, 60.0, 100.0, 120.0, 250.0, 500.0}) EXPECT_LT(kept(options, hz), 0.2) << hz;
  for (const double hz : {5.0, 25.0, 45.0, 700.0, 1000.0}) EXPECT_EQ(kept(options, hz), 1.0) << hz;
  options.low_hz = 90, options.high_hz = 130;
  EXPECT_EQ(kept(options, 60.0), 1.0);
  EXPECT_LT(kept(options, 100.0), 0.1);
  EXPECT_EQ(kept(options, 160.0), 1.0);
}

TEST(AntiFlickerFilter, StartsAfterAsManyPeriodsAsTheThreshold) {
  for (const int threshold : {2, 6, 7}) {
    AntiFlickerOptions options;
    options.start_threshold = threshold, options.stop_threshold = 1;
    AntiFlickerFilter filter(options, kWidth, kHeight);
    const auto out = passed(filter, flicker(100, 1.0, 0, 0));
    // The first change from OFF to ON is at 10 ms, since the first events have no OFF before them.
    EXPECT_EQ(out.size(), static_cast<std::size_t>(threshold + 1) * 32) << threshold;
  }
}

TEST(AntiFlickerFilter, LeavesOtherBlocksAloneAndEndsWithTheFlicker) {
  AntiFlickerFilter filter({}, kWidth, kHeight);
  auto events = flicker(100, 1.0, 8, 4);
  auto still = flicker(4, 1.0, 12, 4);  // the next block
  for (Event& event : still) event.t += 500;
  const Event later{1500 * kMs, 9, 5, 1};
  auto all = merged(events, still);
  all.push_back(later);
  const auto out = passed(filter, all);
  for (const Event& event : still) EXPECT_TRUE(std::binary_search(out.begin(), out.end(), event));
  EXPECT_TRUE(std::binary_search(out.begin(), out.end(), later));
  EXPECT_LT(out.size(), still.size() + events.size() / 5);
}

TEST(AntiFlickerFilter, BandStopAndBandPassTogetherAreAllEvents) {
  const auto events = merged(flicker(100, 0.5, 8, 4), random_events(20'000, 40'000, 6));
  AntiFlickerOptions pass;
  pass.mode = FlickerMode::band_pass;
  AntiFlickerFilter stop({}, kWidth, kHeight), keep(pass, kWidth, kHeight);
  const auto kept_events = passed(keep, events);
  EXPECT_GT(kept_events.size(), 500u);
  EXPECT_EQ(merged(passed(stop, events), kept_events), events);
}

// --- the event rate controller --------------------------------------------------------------------------------------

std::map<std::int64_t, int> per_period(const std::vector<Event>& events, TimeNs period) {
  std::map<std::int64_t, int> counts;
  for (const Event& event : events)
    ++counts[static_cast<std::int64_t>(std::floor(static_cast<double>(event.t) / static_cast<double>(period)))];
  return counts;
}

TEST(RateController, PassesEverythingBelowTheLimit) {
  const auto events = random_events(5000, 100'000, 7);
  RateController controller({200, 60});
  EXPECT_EQ(passed(controller, events), events);
  EXPECT_EQ(controller.dropped(), 0u);
}

TEST(RateController, NeverPassesMoreThanTheLimitAndUsesMostOfIt) {
  const auto events = random_events(200'000, 1'000'000, 8);  // 200 per period
  for (const int limit : {0, 1, 17, 100, 190}) {
    RateController controller({200, limit});
    const auto out = passed(controller, events);
    const auto counts = per_period(out, 200'000);
    for (const auto& [period, count] : counts) EXPECT_LE(count, limit);
    EXPECT_EQ(controller.dropped(), events.size() - out.size());
    EXPECT_GE(static_cast<double>(out.size()), 0.9 * limit * 1000) << limit;
  }
}

// set_cd_event_rate() of OpenEB: rate = count / period. The IMX636 begins with 10000 events per 200 us.
TEST(RateController, PassesFiftyMillionEventsPerSecondByDefault) {
  const auto events = random_events(200'000, 100e6, 11);  // 2 ms
  RateController controller({});
  const auto out = passed(controller, events);
  EXPECT_NEAR(static_cast<double>(out.size()), 50e6 * 2e-3, 1e4);
  for (const auto& [period, count] : per_period(out, 200'000)) EXPECT_LE(count, 10'000);
}

// Rows are read one after the other: dropping must not favour those that come first in a period.
TEST(RateController, DropsFromAllRowsAlike) {
  std::vector<Event> events;
  for (int period = 0; period < 400; ++period) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        events.push_back(
            {period * 200'000 + y * 10'000, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), 1});
    }
  }
  RateController controller({200, 100});
  std::map<int, int> rows;
  std::size_t after_the_first = 0;
  for (const Event& event : passed(controller, events)) {
    if (event.t < 200'000) continue;  // nothing was expected yet
    ++rows[event.y], ++after_the_first;
  }
  ASSERT_EQ(rows.size(), std::size_t{kHeight});
  for (const auto& [y, count] : rows)
    EXPECT_NEAR(count, static_cast<double>(after_the_first) / kHeight,
                0.04 * static_cast<double>(after_the_first) / kHeight)
        << y;
}

// --- the event rate activity filter ---------------------------------------------------------------------------------

/// Events at a constant rate in each of some stretches of 20 ms.
std::vector<Event> stretches(std::initializer_list<double> rates_hz) {
  std::vector<Event> events;
  TimeNs start = 0;
  for (const double rate : rates_hz) {
    for (int i = 0; i < static_cast<int>(rate * 0.02); ++i)
      events.push_back({start + std::llround((i + 0.5) * 1e9 / rate), 0, 0, 1});
    start += 20 * kMs;
  }
  return events;
}

/// The share of the events that pass in each stretch of 20 ms, without its first 2 ms.
std::vector<double> shares(const ActivityFilterOptions& options, std::initializer_list<double> rates_hz) {
  const auto events = stretches(rates_hz);
  ActivityFilter filter(options);
  const auto out = passed(filter, events);
  std::vector<double> all(rates_hz.size()), some(rates_hz.size());
  const auto count = [](const std::vector<Event>& from, std::vector<double>& into) {
    for (const Event& event : from) {
      if (event.t % (20 * kMs) >= 2 * kMs) into[static_cast<std::size_t>(event.t / (20 * kMs))] += 1;
    }
  };
  count(events, all), count(out, some);
  for (std::size_t i = 0; i < all.size(); ++i) some[i] /= all[i];
  return some;
}

TEST(ActivityFilter, PassesAllOrNothingWithHysteresis) {
  ActivityFilterOptions lower;
  lower.lower_start = 50'000, lower.lower_stop = 20'000;
  EXPECT_EQ(shares(lower, {10e3, 30e3, 60e3, 30e3, 10e3, 30e3}), (std::vector<double>{0, 0, 1, 1, 0, 0}));
  ActivityFilterOptions upper;
  upper.upper_stop = 100'000, upper.upper_start = 40'000;
  EXPECT_EQ(shares(upper, {10e3, 60e3, 200e3, 60e3, 30e3, 60e3}), (std::vector<double>{1, 1, 0, 0, 1, 1}));
  EXPECT_EQ(shares({}, {1e3, 1e6}), (std::vector<double>{1, 1}));
}

// As in sensors whose filter has one bound and no hysteresis.
TEST(ActivityFilter, WithoutASecondRateItHasNoHysteresis) {
  ActivityFilterOptions lower;
  lower.lower_start = 50'000;
  EXPECT_EQ(shares(lower, {10e3, 60e3, 30e3, 60e3}), (std::vector<double>{0, 1, 0, 1}));
  ActivityFilterOptions upper;
  upper.upper_stop = 100'000;
  EXPECT_EQ(shares(upper, {60e3, 200e3, 60e3, 200e3}), (std::vector<double>{1, 0, 1, 0}));
}

// --- all of them ----------------------------------------------------------------------------------------------------

FilterOptions everything() {
  FilterOptions options;
  options.region = RegionFilterOptions{false, {{2, 1, 15, 12}, {0, 14, 24, 2}}, {{5, 5}}};
  options.activity = ActivityFilterOptions{1000, 30'000, 10'000, 0, 0};
  options.anti_flicker = AntiFlickerOptions{};
  options.trail = TrailFilterOptions{TrailType::stc_keep_trail, 8000};
  options.rate_controller = RateControllerOptions{1000, 20};
  return options;
}

TEST(FilterChain, DoesNotDependOnHowTheStreamIsCut) {
  const auto events = merged(flicker(100, 0.4, 8, 4), random_events(30'000, 60'000, 9));
  FilterChain whole(everything(), kWidth, kHeight), pieces(everything(), kWidth, kHeight);
  const auto expected = passed(whole, events);
  std::vector<Event> out;
  std::mt19937 random(2);
  for (std::size_t i = 0; i < events.size();) {
    const std::size_t count = std::min<std::size_t>(random() % 700, events.size() - i);
    pieces.process(EventSpan(events).subspan(i, count), out);
    i += count;
  }
  EXPECT_EQ(out, expected);
  EXPECT_GT(out.size(), 500u);
  EXPECT_TRUE(std::includes(events.begin(), events.end(), out.begin(), out.end()));
  std::uint64_t dropped = 0;
  for (const FilterChain::Dropped& filter : whole.dropped()) {
    EXPECT_GT(filter.events, 0u) << filter.filter;
    dropped += filter.events;
  }
  EXPECT_EQ(dropped, events.size() - out.size());
}

TEST(FilterChain, RegionsKeepOrDropTheirPixels) {
  const auto events = random_events(5000, 50'000, 10);
  const auto inside = [](const Event& event) {
    return (event.x >= 2 && event.x < 17 && event.y >= 1 && event.y < 13) || event.y >= 14;
  };
  for (const bool invert : {false, true}) {
    FilterOptions options;
    options.region = RegionFilterOptions{invert, {{2, 1, 15, 12}, {0, 14, 24, 200}}, {{5, 5}, {0, 0}}};
    FilterChain chain(options, kWidth, kHeight);
    std::vector<Event> expected;
    for (const Event& event : events) {
      const bool masked = (event.x == 5 && event.y == 5) || (event.x == 0 && event.y == 0);
      if (inside(event) != invert && !masked) expected.push_back(event);
    }
    EXPECT_EQ(passed(chain, events), expected);
  }
}

TEST(FilterChain, RefusesContradictions) {
  const auto problem = [](auto change) {
    FilterOptions options = everything();
    change(options);
    return message_of<UserError>([&] { FilterChain(options, kWidth, kHeight); });
  };
  EXPECT_TRUE(contains(problem([](auto& o) { o.anti_flicker->low_hz = 600; }), "anti_flicker.low_hz"));
  EXPECT_TRUE(contains(problem([](auto& o) { o.anti_flicker->stop_threshold = 6; }), "stop_threshold"));
  EXPECT_TRUE(contains(problem([](auto& o) { o.activity->lower_stop = 40'000; }), "lower_stop"));
  EXPECT_TRUE(contains(problem([](auto& o) { o.activity->upper_start = 40'000; }), "upper_start"));
  EXPECT_TRUE(contains(problem([](auto& o) { o.activity->upper_stop = 20'000; }), "upper_stop"));
  FilterChain chain({}, kWidth, kHeight);
  std::vector<Event> out;
  const std::vector<Event> outside{{0, kWidth, 0, 1}};
  EXPECT_TRUE(contains(message_of<UserError>([&] { chain.process(outside, out); }), "outside the sensor of 24 x 16"));
}

TEST(FilterChain, RefusesOptionsWithoutEffect) {
  const auto problem = [](const FilterOptions& options) {
    return message_of<UserError>([&] { FilterChain(options, kWidth, kHeight); });
  };
  FilterOptions options;
  options.activity = ActivityFilterOptions{};
  EXPECT_TRUE(contains(problem(options), "activity: has no bound"));
  options = {};
  options.region = RegionFilterOptions{false, {{0, 0, 2, 2}, {kWidth, 3, 5, 5}}, {}};
  EXPECT_TRUE(contains(problem(options), "region.windows.1: (24, 3) lies outside the sensor of 24 x 16 px"));
  options.region = RegionFilterOptions{false, {}, {{3, kHeight}}};
  EXPECT_TRUE(contains(problem(options), "region.masked_pixels.0: (3, 16) lies outside"));
}

TEST(ChipBlocks, NamesTheSensorsThatHaveAFilter) {
  using Lines = std::vector<std::string>;
  EXPECT_EQ(missing_blocks(everything(), "genx320"), Lines{});
  EXPECT_EQ(missing_blocks(everything(), "ideal"), Lines{}) << "no real sensor";
  EXPECT_EQ(missing_blocks(everything(), "v2e-noisy"), Lines{});
  EXPECT_EQ(missing_blocks({}, "dvs128"), Lines{});
  EXPECT_EQ(missing_blocks(everything(), "dvs128").size(), 5U);
  EXPECT_EQ(missing_blocks(everything(), "imx636"),
            Lines{"activity: the imx636 has no such filter, but these have: dvxplorer, gen3.1-vga, genx320; it is "
                  "applied anyway"});
  EXPECT_EQ(missing_blocks(everything(), "imx636@2"), missing_blocks(everything(), "imx636"));
  const Lines davis = missing_blocks(everything(), "davis346");
  ASSERT_EQ(davis.size(), 4U);
  EXPECT_TRUE(contains(davis[1], "anti_flicker: the davis346 has no such filter, but these have: gen4.1, imx636"));
  FilterOptions trail;
  trail.trail.emplace();
  EXPECT_EQ(missing_blocks(trail, "gen3.1-vga").size(), 1U);
}

TEST(FilterChain, RefusedEventsChangeNothing) {
  constexpr TimeNs kLatest = std::numeric_limits<TimeNs>::max();
  const auto events = random_events(2000, 50'000, 12);
  const EventSpan first = EventSpan(events).first(1000), rest = EventSpan(events).subspan(1000);
  FilterChain chain(everything(), kWidth, kHeight), expected(everything(), kWidth, kHeight);
  std::vector<Event> out, none;
  chain.process(first, out);
  for (const std::vector<Event>& wrong :
       std::vector<std::vector<Event>>{{{first.back().t + 5, 1, 1, 1}, {first.back().t + 4, 1, 1, 1}},  // within a call
                                       {{first.back().t - 1, 1, 1, 1}},  // between two calls
                                       {{first.back().t + 5, 1, 1, 1}, {first.back().t + 6, 1, kHeight, 1}},
                                       {{kLatest, 1, 1, 1}}}) {
    EXPECT_THROW(chain.process(wrong, none), UserError);
  }
  EXPECT_TRUE(none.empty());
  chain.process({}, out);
  chain.process(rest, out);
  EXPECT_EQ(out, passed(expected, events));
  FilterChain fresh({}, kWidth, kHeight);
  EXPECT_THROW(fresh.process(std::vector<Event>{{-kLatest, 1, 1, 1}}, none), UserError);
}

}  // namespace
}  // namespace esim
