// Frames that disturb event pixels, found by the bursts that they cause.
#include "esim/stats/sensor/frame_times.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "stats/streams.h"

namespace esim {
namespace {

constexpr TimeNs kPeriod = 44'060 * kNsPerUs, kExposure = 6'020 * kNsPerUs;

/// Independent events at 500 kev/s.
std::vector<Event> background(double duration_s, unsigned seed) {
  return test::events_at(test::poisson_times(5e5, duration_s, seed), 64, 48, seed);
}

/// Adds events of one polarity within 100 us of a time.
void add_burst(std::vector<Event>& events, TimeNs t, int count, std::int8_t polarity, unsigned seed) {
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i)
    events.push_back(
        {t + static_cast<TimeNs>(random() % 100'000), static_cast<std::uint16_t>(random() % 64), 5, polarity});
  std::sort(events.begin(), events.end());
}

TEST(FrameTimes, ExposuresAreFoundByTheBurstsAtTheirEnds) {
  std::vector<Event> events = background(0.2, 1);
  for (int k = 0; k < 4; ++k) {
    const TimeNs end = 20 * kNsPerMs + k * kPeriod;
    if (k != 1) add_burst(events, end, 120, 1, static_cast<unsigned>(k));  // one is missing
    add_burst(events, end - kExposure, 100, -1, static_cast<unsigned>(10 + k));
  }
  const auto found = find_frames(events);
  ASSERT_TRUE(found && found->period && found->exposure());
  EXPECT_NEAR(static_cast<double>(*found->period), static_cast<double>(kPeriod), 30e3);
  EXPECT_NEAR(static_cast<double>(*found->exposure()), static_cast<double>(kExposure), 60e3);
  EXPECT_NEAR(static_cast<double>(*found->end), 20e6, 40e3);
  EXPECT_EQ(*found->since(kNsPerMs).end, *found->end - kNsPerMs);
  const BurstEvents bursts = count_burst_events(events, *found);
  EXPECT_NEAR(bursts.events, 3 * 120 + 4 * 100, 3 * bursts.deviation);
  EXPECT_LT(bursts.deviation, 60);
}

TEST(FrameTimes, OneKindOfBurstLeavesTheExposureUnknown) {
  for (const bool on : {false, true}) {
    std::vector<Event> events = background(0.05, 2);
    add_burst(events, 31 * kNsPerMs, 120, on ? 1 : -1, 3);
    const auto found = find_frames(events);
    ASSERT_TRUE(found) << on;
    EXPECT_FALSE(found->period || found->exposure());
    EXPECT_EQ(found->end.has_value(), on);
    EXPECT_NEAR(static_cast<double>(on ? *found->end : *found->start), 31e6, 40e3);
    EXPECT_NEAR(count_burst_events(events, *found).events, 120, 40);
    // Before it began, the frame has no events.
    EXPECT_EQ(count_burst_events(EventSpan(events).first(10), *found).events, 0);
  }
}

TEST(FrameTimes, NothingIsFoundWithoutFrames) {
  EXPECT_FALSE(find_frames({}));
  for (unsigned seed = 1; seed <= 20; ++seed) EXPECT_FALSE(find_frames(background(0.1, seed))) << seed;
  const std::vector<Event> one{{5, 1, 1, 1}};
  EXPECT_FALSE(find_frames(one));
  EXPECT_EQ(count_burst_events({}, {5, {}, {}}).events, 0);
  // A rate that rises and falls slowly is no burst.
  std::vector<Event> events = background(0.2, 4);
  std::erase_if(events, [](const Event& event) { return (event.t / (5 * kNsPerMs)) % 2 == 1 && event.x % 2 == 0; });
  EXPECT_FALSE(find_frames(events));
}

TEST(FrameTimes, BurstsThatDoNotRecurPeriodicallyAreNoFrames) {
  std::vector<Event> events = background(0.1, 5);
  for (const TimeNs t : {10, 31, 60, 71}) add_burst(events, t * kNsPerMs, 150, 1, static_cast<unsigned>(t));
  EXPECT_FALSE(find_frames(events));
  // The end of one frame and the start of the next, and no other: their distance is no exposure.
  events = background(0.1, 6);
  add_burst(events, 20 * kNsPerMs, 150, 1, 1);
  add_burst(events, 58 * kNsPerMs, 150, -1, 2);
  EXPECT_FALSE(find_frames(events));
  // All pixels see a flash: both polarities at once.
  events = background(0.1, 7);
  add_burst(events, 20 * kNsPerMs, 150, -1, 1);
  add_burst(events, 20 * kNsPerMs + 50'000, 150, 1, 2);
  EXPECT_FALSE(find_frames(events));
}

}  // namespace
}  // namespace esim
