#include "esim/events/event.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "esim/events/event_queue.h"

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

TEST(SortEvents, AgreesWithStdSort) {
  unsigned seed = 0;
  for (const std::size_t count : {0, 1, 2, 255, 256, 257, 5000}) {
    for (const TimeNs span : {TimeNs{1}, TimeNs{3}, TimeNs{2048}, TimeNs{2049}, TimeNs{1'000'000}, TimeNs{1} << 62}) {
      std::vector<Event> events = random_events(count, span, ++seed), expected = events;
      std::sort(expected.begin(), expected.end());
      sort_events(events);
      EXPECT_EQ(events, expected) << count << " events over " << span << " ns";
    }
  }
}

TEST(EventQueue, ReleasesInOrderWhateverTheOrderOfArrival) {
  std::vector<Event> events = random_events(3000, 1000, 77);
  std::vector<Event> expected = events;
  std::sort(expected.begin(), expected.end());

  // An event may arrive at any time before the watermark passes it.
  std::mt19937 random(1);
  EventQueue queue;
  std::vector<Event> released;
  for (TimeNs watermark = -10; watermark < 1000; watermark += 13) {
    for (auto it = events.begin(); it != events.end();) {
      if (it->t <= watermark || random() % 10 == 0) {
        queue.incoming().push_back(*it);
        it = events.erase(it);
      } else {
        ++it;
      }
    }
    const std::size_t before = released.size();
    queue.release_until(watermark, released);
    for (std::size_t i = before; i < released.size(); ++i) EXPECT_LE(released[i].t, watermark);
  }
  queue.incoming().insert(queue.incoming().end(), events.begin(), events.end());
  queue.release_until(2000, released);
  EXPECT_EQ(released, expected);
  EXPECT_EQ(queue.size(), 0U);
}

}  // namespace
}  // namespace esim
