#include "esim/events/event.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <utility>

#include "esim/events/event_queue.h"
#include "esim/events/sort_packed.h"

namespace esim {
namespace {

std::vector<Event> random_events(std::size_t count, TimeNs span, unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<Event> events(count);
  for (Event& event : events) {
    event.t = -5 + static_cast<TimeNs>(random() % static_cast<std::uint64_t>(span));
    event.x = static_cast<std::uint16_t>(random() % 7);
    event.y = static_cast<std::uint16_t>(random() % 5);
    event.polarity = random() % 2 == 0 ? 1 : -1;
  }
  return events;
}

TEST(Event, IsOrderedByTimeRowColumnPolarity) {
  const Event base{10, 5, 5, -1};
  EXPECT_LT(base, (Event{11, 0, 0, -1}));
  EXPECT_LT(base, (Event{10, 0, 6, -1}));
  EXPECT_LT(base, (Event{10, 6, 5, -1}));
  EXPECT_LT(base, (Event{10, 5, 5, 1}));
}

constexpr int kWidth = 7, kHeight = 5;

std::uint64_t packed(const EventPacking& packing, const Event& event) {
  return packing.pack(event.t - packing.origin, packing.place(event.x, event.y), event.polarity > 0);
}

TEST(EventPacking, KeepsEventsAndTheirOrder) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {346, 260}, {1280, 720}, {16384, 16384}}) {
    EventPacking packing(width, height);
    packing.origin = -123;
    EXPECT_GT(packing.longest(), 17 * kNsPerSecond);
    std::mt19937_64 random(1);
    std::vector<std::pair<std::uint64_t, Event>> events;
    for (int i = 0; i < 1000; ++i) {
      const auto span = static_cast<std::uint64_t>(random() % 2 == 0 ? packing.longest() : 3);
      const Event event{packing.origin + static_cast<TimeNs>(random() % span),
                        static_cast<std::uint16_t>(random() % static_cast<unsigned>(width)),
                        static_cast<std::uint16_t>(random() % static_cast<unsigned>(height)),
                        static_cast<std::int8_t>(random() % 2 == 0 ? 1 : -1)};
      Event unpacked;
      packing.unpack(packed(packing, event), unpacked);
      EXPECT_EQ(unpacked, event);
      events.emplace_back(packed(packing, event), event);
    }
    std::sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 1; i < events.size(); ++i) EXPECT_LE(events[i - 1].second, events[i].second);
  }
}

void add(PackedEvents& part, const Event& event) {
  const double time = static_cast<double>(event.t - part.packing().origin), polarity = event.polarity;
  const auto place = static_cast<std::uint32_t>(part.packing().place(event.x, event.y));
  const double times[] = {0, time}, polarities[] = {1, polarity}, reported[] = {0, 1};  // the first one is lost
  const std::uint32_t places[] = {0, place};
  part.add(2, part.packing().origin, times, places, polarities, reported);
}

TEST(SortPacked, AgreesWithStdSort) {
  unsigned seed = 0;
  for (const std::size_t count : {0, 1, 2, 63, 64, 257, 5000, 20000}) {
    for (const TimeNs span : {TimeNs{1}, TimeNs{3}, TimeNs{2048}, TimeNs{2049}, TimeNs{1'000'000}, TimeNs{1} << 50}) {
      EventPacking packing(kWidth, kHeight);
      packing.origin = -5;
      std::vector<std::uint64_t> events, scratch(count);
      for (const Event& event : random_events(count, span, ++seed)) events.push_back(packed(packing, event));
      std::vector<std::uint64_t> expected = events;
      std::sort(expected.begin(), expected.end());
      sort_packed(events, scratch, packing);
      EXPECT_EQ(events, expected) << count << " events over " << span << " ns";
    }
  }
}

/// A queue, and the slow reference: all waiting events in a list.
struct QueueAndList {
  EventQueue queue{kWidth, kHeight};
  std::vector<Event> list;

  void add(const std::vector<Event>& events, TimeNs origin, TimeNs end, unsigned seed) {
    EventPacking packing(kWidth, kHeight);
    packing.origin = origin;
    std::vector<PackedEvents> parts(1 + seed % 3);
    for (PackedEvents& part : parts) part.set_packing(packing);
    for (std::size_t i = 0; i < events.size(); ++i) esim::add(parts[(i * i + seed) % parts.size()], events[i]);
    list.insert(list.end(), events.begin(), events.end());
    std::sort(list.begin(), list.end());
    queue.add(parts, end);
    for (const auto& part : parts) EXPECT_EQ(part.size(), 0U);
  }

  void release(TimeNs watermark) {
    const auto end = std::ranges::upper_bound(list, watermark, {}, &Event::t);
    const std::vector<Event> expected(list.begin(), end);
    list.erase(list.begin(), end);
    EXPECT_TRUE(std::ranges::equal(queue.release_until(watermark), expected)) << "until " << watermark;
    EXPECT_EQ(queue.size(), list.size());
  }
};

/// Intervals of all lengths, events far beyond the expected end, long waits, a start before the waiting events, small
/// and large watermarks, events removed, and states restored.
TEST(EventQueue, AgreesWithASortedList) {
  const Workers one(1), three(3);
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937_64 random(seed);
    const auto below = [&](std::uint64_t most) { return static_cast<TimeNs>(random() % most); };
    QueueAndList both;
    TimeNs now = below(1000) - 500;
    TimeNs step = TimeNs{1} << below(34);
    for (int round = 0; round < 40; ++round) {
      if (below(8) == 0) step = TimeNs{1} << below(34);
      const TimeNs origin = now + 1 + below(static_cast<std::uint64_t>(step) / 4 + 1), end = origin + step;
      std::vector<Event> events = random_events(static_cast<std::size_t>(below(5) == 0 ? 3000 : below(40)), step, seed);
      for (Event& event : events) {
        event.t += 5 + origin;
        if (below(50) == 0) event.t += below(100) * step;
      }
      both.add(events, origin, end, seed);
      const TimeNs watermark = now + below(static_cast<std::uint64_t>(below(3) == 0 ? 4 * step : step));
      if (below(3) != 0) both.queue.sort_until(watermark, below(2) == 0 ? one : three);
      if (below(4) == 0) both.release(watermark - (watermark - now) / 2);
      if (below(6) == 0) {
        const auto odd = [](const Event& event) { return (event.t & 3) == 1; };
        both.queue.remove_if(odd);
        std::erase_if(both.list, odd);
      }
      EXPECT_EQ(both.queue.waiting(), both.list);
      if (below(6) == 0) {
        both.queue.add({}, 0);
        both.queue.restore(both.list);
      }
      both.release(watermark);
      now = watermark;
    }
    both.release(std::numeric_limits<TimeNs>::max());
    EXPECT_TRUE(both.list.empty());
  }
}

}  // namespace
}  // namespace esim
