// Ten million events in every format, bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "esim/formats/formats.h"
#include "formats/event_formats.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr std::size_t kEvents = 10'000'000;

/// Ordered events at times that the format can hold, within at most an hour.
std::vector<Event> random_events(const Format& format, SensorSize sensor, TimeNs duration) {
  std::mt19937_64 random(5);
  std::vector<Event> events(kEvents);
  for (Event& event : events) {
    const auto t = static_cast<TimeNs>(random() % static_cast<std::uint64_t>(duration));
    event.t = t - t % format.resolution;
    event.x = static_cast<std::uint16_t>(random() % static_cast<unsigned>(sensor.width));
    event.y = static_cast<std::uint16_t>(random() % static_cast<unsigned>(sensor.height));
    event.polarity = random() % 2 == 0 ? 1 : -1;
  }
  std::sort(events.begin(), events.end());
  return events;
}

class ManyEvents : public testing::TestWithParam<std::string> {};

TEST_P(ManyEvents, ReadBackAsTheyWere) {
  const Format& format = format_named(GetParam());
  const SensorSize sensor{std::min(format.max_width, 1280), std::min(format.max_height, 720)};
  for (const TimeNs duration : {kNsPerSecond, std::min(format.max_time, 3600 * kNsPerSecond)}) {
    const std::vector<Event> events = random_events(format, sensor, duration);
    const test::TemporaryDirectory base;
    const auto path = base.path() / ("events" + format.extension());
    test::record(*format.create(path, {.unit = TimeUnit::ns}),
                 test::recording_info(sensor.width, sensor.height, 0, duration), events);
    const auto source = open_source(path);
    std::size_t done = 0;
    while (const Record* record = source->next()) {
      const EventSpan portion = std::get<EventsRecord>(*record).events;
      ASSERT_LE(done + portion.size(), events.size());
      ASSERT_TRUE(std::equal(portion.begin(), portion.end(), events.begin() + static_cast<std::ptrdiff_t>(done)))
          << done;
      done += portion.size();
    }
    EXPECT_EQ(done, events.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ManyEvents, testing::ValuesIn(test::event_formats(false)), test::name_of_test);

}  // namespace
}  // namespace esim
