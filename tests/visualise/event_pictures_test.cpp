#include "esim/visualise/event_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "esim/visualise/event_window.h"

namespace esim {
namespace {

// Events at random pixels, in order.
std::vector<Event> scattered(std::size_t count, SensorSize sensor) {
  std::vector<Event> events;
  std::uint64_t state = 12345;
  const auto draw = [&](int below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<int>((state >> 33) % static_cast<unsigned>(below));
  };
  for (std::size_t i = 0; i < count; ++i) {
    events.push_back({static_cast<TimeNs>(1000 * i), static_cast<std::uint16_t>(draw(sensor.width)),
                      static_cast<std::uint16_t>(draw(sensor.height)),
                      static_cast<std::int8_t>(draw(2) == 0 ? -1 : 1)});
  }
  return events;
}

double sum(const Image<float>& image) { return std::accumulate(image.pixels().begin(), image.pixels().end(), 0.0); }

TEST(EventPictures, CountsOnThePixelsThemselves) {
  const std::vector<Event> events = {{1, 0, 0, 1}, {2, 2, 1, -1}, {3, 2, 1, -1}, {4, 2, 1, 1}};
  const EventCounts counts = count_events(events, picture_grid({3, 2}, 100, 100));
  EXPECT_EQ(std::vector<float>(counts.on.pixels().begin(), counts.on.pixels().end()),
            (std::vector<float>{1, 0, 0, 0, 0, 1}));
  EXPECT_EQ(std::vector<float>(counts.off.pixels().begin(), counts.off.pixels().end()),
            (std::vector<float>{0, 0, 0, 0, 0, 2}));
}

TEST(EventPictures, NoEventIsLostOnAnyGrid) {
  const SensorSize sensor{37, 1000};
  const std::vector<Event> events = scattered(5000, sensor);
  double on = 0;
  for (const Event& event : events) on += event.polarity > 0;
  for (const auto& [width, height] : {std::pair{1, 1}, {10, 7}, {36, 999}, {37, 1000}, {4000, 4000}}) {
    const PictureGrid grid = picture_grid(sensor, width, height);
    EXPECT_LE(grid.width, 37);
    EXPECT_LE(grid.height, 1000);
    const EventCounts counts = count_events(events, grid);
    EXPECT_EQ(sum(counts.on), on);
    EXPECT_EQ(sum(counts.off), 5000 - on);
  }
}

TEST(EventPictures, ColoursTellPolarityAndNumber) {
  const Rgb ground{24, 27, 34};
  const std::vector<Event> events = {{1, 0, 0, 1}, {2, 1, 0, -1}, {3, 1, 0, -1}};
  const EventCounts counts = count_events(events, picture_grid({3, 1}, 3, 1));
  const Image<Rgb> picture = render_events(counts.on, counts.off, Image<Rgb>(3, 1, ground));
  EXPECT_EQ(picture(0, 0), mix(ground, kOnColour, 0.35f + 0.65f / std::log2(9.0f)));
  EXPECT_EQ(picture(1, 0), mix(ground, kOffColour, 0.35f + 0.65f * std::log2(3.0f) / std::log2(9.0f)));
  EXPECT_EQ(picture(2, 0), ground);
}

TEST(TimeSurface, DecaysExponentiallyFromTheLatestEvent) {
  TimeSurface surface(picture_grid({2, 2}, 2, 2));
  const std::vector<Event> events = {{100, 0, 0, 1}, {300, 0, 0, -1}, {400, 1, 1, 1}};
  surface.add(events);
  for (const double tau : {50.0, 1000.0}) {
    for (const TimeNs t : {400, 500, 5000}) {
      const auto later = static_cast<double>(t);
      EXPECT_FLOAT_EQ(surface.value(0, 0, t, tau), static_cast<float>(-std::exp(-(later - 300) / tau)));
      EXPECT_FLOAT_EQ(surface.value(1, 1, t, tau), static_cast<float>(std::exp(-(later - 400) / tau)));
      EXPECT_EQ(surface.value(1, 0, t, tau), 0);
    }
  }
  const Rgb ground{10, 20, 30};
  const Image<Rgb> now = surface.draw(400, 100, ground);
  EXPECT_EQ(now(1, 1), kOnColour);
  EXPECT_EQ(now(0, 0), mix(ground, kOffColour, std::exp(-1.0f)));
  EXPECT_EQ(now(1, 0), ground);
  EXPECT_EQ(surface.draw(1'000'000, 100, ground)(1, 1), ground);
}

TEST(EventWindow, HoldsWhatIsNotForgotten) {
  const std::vector<Event> events = scattered(1000, {8, 8});
  EventWindow window(1 << 20);
  for (std::size_t i = 0; i < events.size(); i += 10) {
    window.add(EventSpan(events).subspan(i, 10));
    window.forget_until(events[i].t);
    ASSERT_EQ(window.events().size(), 9u);
    EXPECT_EQ(window.events().front(), events[i + 1]);
    EXPECT_EQ(window.events().back(), events[i + 9]);
  }
}

TEST(EventWindow, HoldsTheLatestOnly) {
  const std::vector<Event> events = scattered(1000, {8, 8});
  EventWindow window(30);
  window.add(events);
  const EventSpan last = EventSpan(events).last(30);
  EXPECT_TRUE(std::equal(last.begin(), last.end(), window.events().begin(), window.events().end()));
  EXPECT_EQ(window.stride(), 1u);
}

TEST(EventWindow, ThinsEvenly) {
  const std::vector<Event> events = scattered(1000, {8, 8});
  EventWindow window(100, true);
  window.add(events);
  EXPECT_EQ(window.stride(), 16u);
  ASSERT_EQ(window.events().size(), 63u);
  for (std::size_t i = 0; i < 63; ++i) EXPECT_EQ(window.events()[i], events[16 * i]);
}

}  // namespace
}  // namespace esim
