#include "esim/events/event.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

#include "esim/events/event_queue.h"
#include "esim/events/event_sorter.h"

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

TEST(EventSorter, AgreesWithStdSort) {
  const Workers one(1), three(3);
  unsigned seed = 0;
  EventSorter sorter;
  for (const std::size_t count : {0, 1, 2, 63, 64, 257, 5000, 20000}) {
    for (const TimeNs span : {TimeNs{1}, TimeNs{3}, TimeNs{2048}, TimeNs{2049}, TimeNs{1'000'000}, TimeNs{1} << 50}) {
      std::vector<Event> expected = random_events(count, span, ++seed);
      EventBuffer sorted;
      EventPacking packing(kWidth, kHeight);
      packing.origin = -5;
      for (const Workers* workers : {&one, &three}) {
        std::vector<PackedEvents> parts(3);
        for (PackedEvents& part : parts) part.expect(packing, seed % 2 == 0 ? span : span / 3);
        for (std::size_t i = 0; i < count; ++i) add(parts[(i * i) % 3], expected[i]);
        sorter.sort(parts, *workers, sorted);
        std::sort(expected.begin(), expected.end());
        EXPECT_TRUE(std::ranges::equal(sorted.events(), expected)) << count << " events over " << span << " ns";
        for (const auto& part : parts) EXPECT_EQ(part.size(), 0U);
      }
    }
  }
}

TEST(EventQueue, ReleasesInOrderWhateverTheOrderOfArrival) {
  std::vector<Event> events = random_events(3000, 1000, 77);
  std::vector<Event> expected = events;
  std::sort(expected.begin(), expected.end());

  // An event may arrive at any time before the watermark passes it.
  const Workers one(1);
  EventPacking packing(kWidth, kHeight);
  packing.origin = -5;
  std::mt19937 random(1);
  EventQueue queue;
  std::vector<Event> released;
  std::vector<PackedEvents> parts(2);
  for (PackedEvents& part : parts) part.expect(packing, 1000);
  for (TimeNs watermark = -10; watermark < 1200; watermark += 13) {
    for (auto it = events.begin(); it != events.end();) {
      if (it->t <= watermark || random() % 10 == 0) {
        add(parts[random() % 2], *it);
        it = events.erase(it);
      } else {
        ++it;
      }
    }
    queue.add(parts, one);
    for (const Event& event : queue.release_until(watermark)) {
      EXPECT_LE(event.t, watermark);
      released.push_back(event);
    }
  }
  EXPECT_EQ(released, expected);
  EXPECT_EQ(queue.size(), 0U);
}

}  // namespace
}  // namespace esim
