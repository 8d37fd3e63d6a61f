#include "esim/sensors/readout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "sensors/feed.h"

namespace esim {
namespace {

constexpr int kHeight = 20;

std::vector<Event> random_events(std::size_t count, TimeNs span, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<Event> events(count);
  for (Event& event : events) {
    event = {static_cast<TimeNs>(random() % static_cast<std::uint64_t>(span)),
             static_cast<std::uint16_t>(random() % 50), static_cast<std::uint16_t>(random() % kHeight),
             static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)};
  }
  std::sort(events.begin(), events.end());
  return events;
}

/// The rules of ReadoutOptions, in whole nanoseconds, with a list that is searched.
std::vector<Event> by_the_rules(const std::vector<Event>& events, TimeNs per_event, TimeNs per_row,
                                std::size_t capacity, std::int64_t& dropped) {
  std::vector<Event> waiting, out;
  TimeNs free_at = std::numeric_limits<TimeNs>::min();
  std::size_t next = 0;
  while (next < events.size() || !waiting.empty()) {
    const TimeNs arrival = next < events.size() ? events[next].t : std::numeric_limits<TimeNs>::max();
    const TimeNs service = waiting.empty() ? std::numeric_limits<TimeNs>::max() : std::max(free_at, waiting[0].t);
    if (arrival <= service) {  // what arrives at the time of a service is still taken
      if (waiting.size() < capacity) {
        waiting.push_back(events[next]);
      } else {
        ++dropped;
      }
      ++next;
      continue;
    }
    const int row = waiting[0].y;
    std::vector<Event> served;
    for (auto it = waiting.begin(); it != waiting.end();) {
      if (it->y != row) {
        ++it;
        continue;
      }
      served.push_back({service, it->x, it->y, it->polarity});
      it = waiting.erase(it);
    }
    std::sort(served.begin(), served.end());
    out.insert(out.end(), served.begin(), served.end());
    free_at = service + std::max<TimeNs>(1, per_row + per_event * static_cast<TimeNs>(served.size()));
  }
  return out;
}

TEST(Readout, FollowsItsRules) {
  unsigned seed = 0;
  for (const TimeNs span : {TimeNs{2'000'000}, TimeNs{100'000}, TimeNs{20'000}}) {
    for (const int capacity : {1'000'000, 100, 3}) {
      for (const TimeNs per_row : {0, 40, 3000}) {
        const std::vector<Event> events = random_events(2000, span, ++seed);
        Readout readout(
            {.rate_mev_per_s = 100, .row_time_us = static_cast<double>(per_row) * 1e-3, .queue_events = capacity},
            kHeight);
        std::vector<Event> out;
        // In pieces, as watermarks come.
        std::mt19937 random(seed);
        std::size_t begin = 0;
        for (TimeNs until = 0; begin < events.size() || readout.waiting() > 0; until += 1 + random() % 30'000) {
          std::size_t end = begin;
          while (end < events.size() && events[end].t <= until) ++end;
          readout.advance(EventSpan(events).subspan(begin, end - begin), until, out);
          begin = end;
        }
        std::int64_t dropped = 0;
        const std::vector<Event> expected =
            by_the_rules(events, 10, per_row, static_cast<std::size_t>(capacity), dropped);
        EXPECT_EQ(out, expected);
        EXPECT_EQ(readout.dropped(), dropped);
        EXPECT_EQ(out.size() + static_cast<std::size_t>(dropped), events.size());
        EXPECT_TRUE(std::is_sorted(out.begin(), out.end()));
      }
    }
  }
}

TEST(Readout, KeepsToItsRateUnderLoad) {
  const std::vector<Event> events = random_events(50'000, 1'000'000, 3);  // 50 events per us
  Readout readout({.rate_mev_per_s = 3, .queue_events = 200}, kHeight);
  std::vector<Event> out;
  readout.advance(events, 1'000'000, out);
  EXPECT_NEAR(static_cast<double>(out.size()), 3000, 30);
  EXPECT_EQ(out.size() + readout.waiting() + static_cast<std::size_t>(readout.dropped()), events.size());
  EXPECT_LE(readout.waiting(), 200U);
}

TEST(Readout, OfACameraLosesNothingThatItDoesNotCount) {
  EventCameraOptions options;
  options.contrast_threshold = 0.1;
  EventCameraOptions limited = options;
  limited.readout = {.rate_mev_per_s = 2, .row_time_us = 1, .queue_events = 300};
  test::Feed free(options, 64, 48), narrow(limited, 64, 48);
  std::size_t all = 0, read = 0;
  for (int k = 0; k <= 20; ++k) {
    const Image<float> frame(64, 48, 0.1F * static_cast<float>(1 + k % 3));
    free.frame(frame, k * kNsPerMs), narrow.frame(frame, k * kNsPerMs);
    all += free.events(k * kNsPerMs).size(), read += narrow.events(k * kNsPerMs).size();
  }
  const EventCameraStatistics statistics = narrow.camera().statistics();
  EXPECT_GT(statistics.dropped, 1000);
  EXPECT_EQ(all, read + static_cast<std::size_t>(statistics.dropped + statistics.in_flight));
}

}  // namespace
}  // namespace esim
