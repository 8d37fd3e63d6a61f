#include "esim/visualise/player.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esim/core/error.h"
#include "esim/preview/colours.h"

namespace esim {
namespace {

/// Records in memory, in the order given.
class Memory final : public Source {
 public:
  Memory(SensorSize sensor, TimeNs start) {
    info_.cameras.resize(1);
    info_.cameras[0].model.width = sensor.width;
    info_.cameras[0].model.height = sensor.height;
    info_.start = info_.end = start;
  }
  void add(Record record) { records_.push_back(std::move(record)); }

  const RecordingInfo& info() const override { return info_; }
  const Record* next() override { return at_ < records_.size() ? &records_[at_++] : nullptr; }
  double progress() const override { return 0.5; }
  void rewind() { at_ = 0; }

 private:
  RecordingInfo info_;
  std::vector<Record> records_;
  std::size_t at_ = 0;
};

constexpr SensorSize kSensor{16, 12};

// `count` events, one per ms from 1 ms after `start`, each at a different pixel.
std::vector<Event> regular(int count, TimeNs start = 0) {
  std::vector<Event> events;
  for (int i = 0; i < count; ++i) {
    events.push_back({start + (i + 1) * kNsPerMs, static_cast<std::uint16_t>(i % 16),
                      static_cast<std::uint16_t>(i / 16 % 12), static_cast<std::int8_t>(i % 2 == 0 ? 1 : -1)});
  }
  return events;
}

const auto kProceed = [](double) { return true; };

RecordingOverview overview_of(Memory& source, const Extent& extent = {}) {
  RecordingOverview found = *read_overview(source, extent, kProceed);
  source.rewind();
  return found;
}

PlayOptions events_only() { return {.views = {View::events}, .slow_motion = 1, .window_s = 0.01}; }

// Number of pixels of a colour; exact if the panel is enlarged by an integer factor.
std::size_t pixels_with(const Image<Rgb>& picture, Rgb colour) {
  return static_cast<std::size_t>(std::count(picture.pixels().begin(), picture.pixels().end(), colour));
}

TEST(RecordingOverview, KnowsTheRecording) {
  Memory source(kSensor, 5 * kNsPerSecond);
  const auto events = regular(100, 5 * kNsPerSecond);
  source.add(EventsRecord{0, EventSpan(events).first(60)});
  source.add(EventsRecord{0, EventSpan(events).last(40)});
  const RecordingOverview all = overview_of(source);
  EXPECT_EQ(all.events, 100u);
  EXPECT_EQ(all.origin, 5 * kNsPerSecond);
  EXPECT_EQ(all.end, events.back().t);
  const RecordingOverview part = overview_of(source, {.start_s = 0.0205, .duration_s = 0.03});
  EXPECT_EQ(part.events, 30u);
  EXPECT_EQ(part.start, 5 * kNsPerSecond + 20'500'000);
  EXPECT_EQ(part.end, part.start + 30'000'000);
}

TEST(RecordingOverview, FindsAnUnknownSensor) {
  Memory source({0, 0}, 0);
  const std::vector<Event> events = {{1, 5, 300, 1}, {2, 700, 2, 1}};
  source.add(EventsRecord{0, events});
  EXPECT_EQ(overview_of(source).sensor.width, 701);
  EXPECT_EQ(overview_of(source).sensor.height, 301);
}

TEST(RecordingOverview, StopsWhenToldTo) {
  Memory source(kSensor, 0);
  const auto events = regular(3);
  source.add(EventsRecord{0, events});
  EXPECT_FALSE(read_overview(source, {}, [](double) { return false; }));
}

TEST(PlayOptions, AreChosenToBeSeen) {
  RecordingOverview found{.sensor = {346, 260}, .start = 0, .end = kNsPerSecond / 2, .events = 355'000};
  const PlayOptions slow = choose_missing({}, found);
  EXPECT_EQ(slow.slow_motion, 10);
  EXPECT_EQ(video_instants(found, slow).count, 151u);
  EXPECT_NEAR(slow.window_s, 0.02, 1e-12);
  found.end = 60 * kNsPerSecond;
  EXPECT_EQ(choose_missing({}, found).slow_motion, 1);
  EXPECT_EQ(slow.views, (std::vector<View>{View::events, View::time_surface, View::space_time}));
  EXPECT_THROW(choose_missing({.views = {View::depth}}, found), UserError);
  found.events = 0;
  EXPECT_THROW(choose_missing({}, found), UserError);
}

TEST(Player, ShowsEveryEventOnceWhereWindowsMeet) {
  Memory source(kSensor, 0);
  const auto events = regular(160);
  source.add(EventsRecord{0, events});
  const RecordingOverview found = overview_of(source);
  PlayOptions options = choose_missing(events_only(), found);
  options.width = 40 + 16 * 20;
  // Windows of 10 ms that end at 10, 20, ... ms: ten pixels each.
  Player player(source, 0, found, options, {.first = 10 * kNsPerMs, .step_ns = 1e7, .count = 16});
  const Rgb on = mix(options.theme.ground, kOnColour, 0.35f + 0.65f / std::log2(9.0f));
  std::size_t frames = 0;
  while (const auto picture = player.next_picture()) {
    ++frames;
    EXPECT_EQ(pixels_with(*picture, on), 5u * 20 * 20);
    EXPECT_EQ(pixels_with(*picture, options.theme.ground), (16u * 12 - 10) * 20 * 20);
  }
  EXPECT_EQ(frames, 16u);
}

TEST(Player, CountsTheLatestEventsWhereAskedTo) {
  Memory source(kSensor, 0);
  const auto events = regular(160);
  source.add(EventsRecord{0, events});
  const RecordingOverview found = overview_of(source);
  PlayOptions options = events_only();
  options.window_events = 24;
  options.width = 40 + 16 * 20;
  Player player(source, 0, found, choose_missing(options, found), {.first = 100 * kNsPerMs});
  EXPECT_EQ(pixels_with(*player.next_picture(), kDarkTheme.ground), (16u * 12 - 24) * 20 * 20);
}

TEST(Player, WaitsForPicturesThatComeLate) {
  // Images after all the events of their time, and one of them beyond the last instant.
  Memory source(kSensor, 0);
  const auto events = regular(30);
  const Image<float> black(16, 12, 0.0f), white(16, 12, 1.0f);
  source.add(EventsRecord{0, events});
  source.add(ImageRecord{0, 0, black});
  source.add(ImageRecord{0, 10 * kNsPerMs, white});
  source.add(ImageRecord{0, 20 * kNsPerMs, black});
  const RecordingOverview found = overview_of(source);
  PlayOptions options = events_only();
  options.views = {View::image};
  Player player(source, 0, found, choose_missing(options, found), {.first = 5 * kNsPerMs, .step_ns = 1e7, .count = 3});
  EXPECT_EQ((*player.next_picture())(100, 100), (Rgb{0, 0, 0}));
  EXPECT_EQ((*player.next_picture())(100, 100), (Rgb{255, 255, 255}));
  EXPECT_EQ((*player.next_picture())(100, 100), (Rgb{0, 0, 0}));
  EXPECT_FALSE(player.next_picture());
}

TEST(Player, ShowsAllThatGroundTruthTells) {
  Memory source(kSensor, 0);
  const auto events = regular(30);
  const Image<float> grey(16, 12, 0.2f), depth(16, 12, 3.0f), x(16, 12, 50.0f), y(16, 12, 0.0f);
  Image<std::uint16_t> frame(16, 12, 1023);
  source.add(
      TruthRecord{.t = 0, .T_world_camera = {}, .irradiance = grey, .depth = depth, .motion_x = x, .motion_y = y});
  source.add(EventsRecord{0, events});
  source.add(FrameRecord{.t = 3 * kNsPerMs, .image = frame, .bits = 10});
  const RecordingOverview found = overview_of(source);
  const PlayOptions options = choose_missing({.slow_motion = 1}, found);
  EXPECT_EQ(options.views.size(), static_cast<std::size_t>(kViews));
  Player player(source, 0, found, options, {.first = 10 * kNsPerMs});
  const PageLayout layout = player.layout();
  const auto page = player.next();
  ASSERT_TRUE(page);
  EXPECT_EQ(page->width(), layout.width);
  const auto middle_of = [&](View view) {
    const auto index = std::find(layout.views.begin(), layout.views.end(), view) - layout.views.begin();
    const Tile panel = layout.panel(static_cast<std::size_t>(index));
    return (*page)(panel.x + panel.width / 2, panel.y + panel.height / 2);
  };
  EXPECT_EQ(middle_of(View::image), (Rgb{255, 255, 255}));  // the frame, not the ground truth
  EXPECT_EQ(middle_of(View::depth), colour_depth(3, found.depth.near_m(), found.depth.far_m()));
  EXPECT_EQ(middle_of(View::motion), colour_motion(50, 0, found.motion.full_px_per_s()));
}

TEST(Player, OneEventAndExtremeSensors) {
  for (const SensorSize sensor : {SensorSize{1, 1}, {65536, 1}, {1, 65536}, {65536, 65536}}) {
    Memory source(sensor, 0);
    const std::vector<Event> events = {
        {0, static_cast<std::uint16_t>(sensor.width - 1), static_cast<std::uint16_t>(sensor.height - 1), -1}};
    source.add(EventsRecord{0, events});
    const RecordingOverview found = overview_of(source);
    const PlayOptions options = choose_missing({.width = 400}, found);
    Player player(source, 0, found, options, video_instants(found, options));
    const auto page = player.next();
    ASSERT_TRUE(page);
    EXPECT_EQ(page->width() % 2, 0);
    EXPECT_EQ(page->height() % 2, 0);
    EXPECT_FALSE(player.next());
  }
}

TEST(Page, LayoutsAreEvenAndHoldTheirPanels) {
  const std::vector<View> all = {View::events, View::time_surface, View::space_time,
                                 View::image,  View::depth,        View::motion};
  for (std::size_t count = 1; count <= all.size(); ++count) {
    for (const SensorSize sensor : {SensorSize{346, 260}, {1280, 720}, {3, 1000}}) {
      for (const int width : {0, 128, 1001}) {
        const PageLayout layout({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count)}, sensor, width);
        EXPECT_EQ(layout.width % 2 + layout.height % 2, 0);
        const Tile last = layout.panel(count - 1);
        EXPECT_LE(last.x + last.width, layout.width);
        EXPECT_LT(last.y + last.height, layout.height);
        EXPECT_GE(layout.columns * layout.rows, static_cast<int>(count));
      }
    }
  }
}

}  // namespace
}  // namespace esim
