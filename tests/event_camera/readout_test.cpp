#include "esim/event_camera/readout/readout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

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

/// A literal implementation of the rules of ReadoutOptions, in whole nanoseconds, with a linear search.
std::vector<Event> by_the_rules(const std::vector<Event>& events, TimeNs per_event, TimeNs per_row,
                                std::size_t capacity, std::int64_t& dropped) {
  std::vector<Event> waiting, out;
  TimeNs free_at = std::numeric_limits<TimeNs>::min();
  std::size_t next = 0;
  while (next < events.size() || !waiting.empty()) {
    const TimeNs arrival = next < events.size() ? events[next].t : std::numeric_limits<TimeNs>::max();
    const TimeNs service = waiting.empty() ? std::numeric_limits<TimeNs>::max() : std::max(free_at, waiting[0].t);
    if (arrival <= service) {  // requests that arrive at the time of a service are included
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

/// Passes requests to the readout, and serves its rows when they are due, until a time.
void run(Readout& readout, EventSpan events, TimeNs until, std::vector<Event>& out) {
  const auto serve_before = [&](TimeNs t) {
    for (TimeNs service = readout.next_service(); service < t; service = readout.next_service()) {
      for (const Event& request : readout.serve()) out.push_back({service, request.x, request.y, request.polarity});
    }
  };
  for (const Event& event : events) {
    serve_before(event.t);
    readout.take(event);
  }
  serve_before(until + 1);
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
        // In portions, like watermarks.
        std::mt19937 random(seed);
        std::size_t begin = 0;
        for (TimeNs until = 0; begin < events.size() || readout.waiting() > 0; until += 1 + random() % 30'000) {
          std::size_t end = begin;
          while (end < events.size() && events[end].t <= until) ++end;
          run(readout, EventSpan(events).subspan(begin, end - begin), until, out);
          begin = end;
        }
        std::int64_t dropped = 0;
        std::vector<Event> expected = by_the_rules(events, 10, per_row, static_cast<std::size_t>(capacity), dropped);
        std::ranges::sort(out), std::ranges::sort(expected);  // here a pixel may have several requests in its row
        EXPECT_EQ(out, expected);
        EXPECT_EQ(readout.dropped(), dropped);
        EXPECT_EQ(out.size() + static_cast<std::size_t>(dropped), events.size());
      }
    }
  }
}

TEST(Readout, KeepsToItsRateUnderLoad) {
  const std::vector<Event> events = random_events(50'000, 1'000'000, 3);  // 50 events per us
  Readout readout({.rate_mev_per_s = 3, .queue_events = 200}, kHeight);
  std::vector<Event> out;
  run(readout, events, 1'000'000, out);
  EXPECT_NEAR(static_cast<double>(out.size()), 3000, 30);
  EXPECT_EQ(out.size() + readout.waiting() + static_cast<std::size_t>(readout.dropped()), events.size());
  EXPECT_LE(readout.waiting(), 200U);
}

}  // namespace
}  // namespace esim
