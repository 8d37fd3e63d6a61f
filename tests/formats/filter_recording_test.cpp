#include "esim/formats/filter_recording.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

constexpr int kWidth = 64, kHeight = 48;
const auto kGoOn = [](double) { return true; };

FilterOptions some_filters() {
  FilterOptions options;
  options.region = RegionFilterOptions{false, {{4, 4, 40, 40}}, {{20, 20}}};
  options.trail = TrailFilterOptions{TrailType::stc_keep_trail, 200'000};
  options.rate_controller = RateControllerOptions{1000, 5};
  return options;
}

/// A recording of two cameras in memory, in records of random size, with poses and points of events between them.
class Given final : public Source {
 public:
  explicit Given(unsigned seed, std::size_t largest = 700) {
    info_ = test::recording_info(kWidth, kHeight, 5 * kNsPerSecond, 6 * kNsPerSecond);
    info_.cameras.push_back(info_.cameras.front());
    info_.cameras.back().name = "right";
    std::mt19937 random(seed);
    points_.resize(100);
    std::vector<std::size_t> done(2);
    while (done[0] < events_[0].size() || done[1] < events_[1].size()) {
      const std::size_t camera = random() % 2;
      const std::vector<Event>& all = events_[camera];
      const std::size_t count = std::min(1 + random() % largest, all.size() - done[camera]);
      if (count == 0) continue;
      records_.emplace_back(EventsRecord{static_cast<int>(camera), EventSpan(all).subspan(done[camera], count)});
      done[camera] += count;
      records_.emplace_back(PoseRecord{.t = info_.start});
    }
  }
  const RecordingInfo& info() const override { return info_; }
  const Record* next() override { return done_ < records_.size() ? &records_[done_++] : nullptr; }
  double progress() const override { return static_cast<double>(done_) / static_cast<double>(records_.size()); }

  RecordingInfo info_;
  std::vector<Event> events_[2] = {test::random_events(20'000, kWidth, kHeight, 5 * kNsPerSecond, 6 * kNsPerSecond, 1),
                                   test::random_events(9000, kWidth, kHeight, 5 * kNsPerSecond, 6 * kNsPerSecond, 2)};
  std::vector<Eigen::Vector3f> points_;
  std::vector<Record> records_;
  std::size_t done_ = 0;
};

struct Read {
  std::vector<Event> events[2];
  std::size_t poses = 0;
};

Read all_of(Source& source) {
  Read all;
  while (const Record* record = source.next()) {
    if (const auto* events = std::get_if<EventsRecord>(record)) {
      auto& to = all.events[static_cast<std::size_t>(events->camera)];
      to.insert(to.end(), events->events.begin(), events->events.end());
    } else {
      all.poses += std::holds_alternative<PoseRecord>(*record) ? 1 : 0;
    }
  }
  return all;
}

TEST(FilterRecording, EachCameraHasFiltersOfItsOwnAndTheRecordsDoNotMatter) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    auto given = std::make_unique<Given>(seed, seed == 3 ? 1'000'000 : 700);
    const std::vector<Event> input[2] = {given->events_[0], given->events_[1]};
    const std::size_t poses = given->records_.size() / 2;
    std::vector<FilteredCamera> cameras;
    const auto source = filtered(std::move(given), some_filters(), "", cameras);
    const Read read = all_of(*source);
    EXPECT_EQ(read.poses, poses);
    ASSERT_EQ(cameras.size(), 2U);
    for (const std::size_t camera : {0U, 1U}) {
      FilterChain chain(some_filters(), kWidth, kHeight);
      std::vector<Event> expected;
      chain.process(input[camera], expected);
      EXPECT_EQ(read.events[camera], expected);
      EXPECT_EQ(cameras[camera].events, input[camera].size());
      EXPECT_EQ(cameras[camera].kept(), expected.size());
      EXPECT_GT(expected.size(), 500U);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(cameras[camera].dropped[i].filter, chain.dropped()[i].filter);
        EXPECT_EQ(cameras[camera].dropped[i].events, chain.dropped()[i].events);
        EXPECT_GT(chain.dropped()[i].events, 0U);
      }
    }
    EXPECT_EQ(cameras[1].name, "right");
  }
}

TEST(FilterRecording, OtherCamerasThanTheChosenOneAreLeftAlone) {
  auto given = std::make_unique<Given>(4);
  given->info_.cameras[0].model.width = 0;  // unknown, which is no problem for a camera that is not filtered
  const std::vector<Event> left = given->events_[0], right = given->events_[1];
  std::vector<FilteredCamera> cameras;
  const auto source = filtered(std::move(given), some_filters(), "right", cameras);
  const Read read = all_of(*source);
  EXPECT_EQ(read.events[0], left);
  EXPECT_LT(read.events[1].size(), right.size());
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].name, "right");
}

TEST(FilterRecording, PointsOfEventsAreLeftOutAndNamed) {
  auto given = std::make_unique<Given>(5);
  given->records_.emplace_back(EventPointsRecord{0, EventSpan(given->events_[0]).first(100), given->points_});
  std::vector<FilteredCamera> cameras;
  const auto source = filtered(std::move(given), some_filters(), "", cameras);
  while (const Record* record = source->next()) EXPECT_FALSE(std::holds_alternative<EventPointsRecord>(*record));
  EXPECT_EQ(source->not_read(), std::vector<std::string>{"the points of events"});
}

TEST(FilterRecording, NeedsTheSizeOfTheSensor) {
  auto given = std::make_unique<Given>(6);
  given->info_.cameras[1].model.height = 0;
  std::vector<FilteredCamera> cameras;
  const auto source = filtered(std::move(given), some_filters(), "", cameras);
  try {
    all_of(*source);
    FAIL();
  } catch (const RemediableError& error) {
    EXPECT_TRUE(contains(error.what(), "size of the sensor of right"));
    EXPECT_EQ(error.remedy(), Remedy::sensor_size);
  }
}

TEST(FilterRecording, FoldersSayWhatWasDone) {
  const test::TemporaryDirectory base;
  const auto from = base.path() / "from.h5", to = base.path() / "to";
  const std::vector<Event> events = test::random_events(20'000, kWidth, kHeight, 0, kNsPerSecond);
  test::record(*format_named("dsec").create(from, {.unit = TimeUnit::ns}),
               test::recording_info(kWidth, kHeight, 0, kNsPerSecond), events);
  const FilterSummary summary = filter_recording(from, format_named("recording"), to, some_filters(),
                                                 {.copy = {.write = {.unit = TimeUnit::ns}}}, kGoOn);
  const auto report = nlohmann::json::parse(test::content(to / "report.json"));
  EXPECT_EQ(report["filters"]["trail"]["type"], "stc_keep_trail");
  EXPECT_EQ(report["filters"]["region"]["windows"][0]["width"], 40);
  EXPECT_FALSE(report["filters"].contains("activity"));
  const auto& camera = report["filtered"][0];
  EXPECT_EQ(camera["events"], 20'000);
  EXPECT_EQ(camera["kept"], summary.copy.copied.at(Content::events));
  std::uint64_t dropped = 0;
  for (const auto& count : camera["dropped"]) dropped += count.get<std::uint64_t>();
  EXPECT_EQ(dropped + camera["kept"].get<std::uint64_t>(), 20'000U);
  EXPECT_TRUE(contains(describe(summary.cameras), "20,000 events"));
}

// A recording of which no event passes is still a recording, in every format.
TEST(FilterRecording, NothingMayPass) {
  const test::TemporaryDirectory base;
  const auto from = base.path() / "from.npz";
  const std::vector<Event> events = test::random_events(20'000, kWidth, kHeight, 0, kNsPerSecond);
  test::record(*format_named("npz").create(from, {}), test::recording_info(kWidth, kHeight, 0, kNsPerSecond), events);
  FilterOptions nothing;
  nothing.rate_controller = RateControllerOptions{200, 0};
  for (const Format& format : all_formats()) {
    if (!format.create || !format.can_hold(Content::events)) continue;
    const auto to = base.path() / ("to_" + format.name);
    const FilterSummary summary = filter_recording(from, format, to, nothing, {}, kGoOn);
    EXPECT_EQ(summary.copy.copied.at(Content::events), 0U) << format.name;
    EXPECT_EQ(summary.cameras.at(0).kept(), 0U) << format.name;
    EXPECT_TRUE(std::filesystem::exists(to)) << format.name;
  }
}

TEST(FilterRecording, InvalidFiltersLeaveNothing) {
  const test::TemporaryDirectory base;
  const auto from = base.path() / "from.npz", to = base.path() / "to.npz";
  test::record(*format_named("npz").create(from, {}), test::recording_info(kWidth, kHeight, 0, kNsPerSecond),
               test::random_events(200, kWidth, kHeight, 0, kNsPerSecond));
  FilterOptions wrong;
  wrong.anti_flicker = AntiFlickerOptions{.low_hz = 300, .high_hz = 200};
  EXPECT_TRUE(
      contains(message_of<UserError>([&] { filter_recording(from, format_named("npz"), to, wrong, {}, kGoOn); }),
               "anti_flicker.low_hz"));
  wrong = {};
  wrong.region = RegionFilterOptions{false, {{kWidth, 0, 1, 1}}, {}};
  EXPECT_TRUE(
      contains(message_of<UserError>([&] { filter_recording(from, format_named("npz"), to, wrong, {}, kGoOn); }),
               "region.windows.0"));
  EXPECT_FALSE(std::filesystem::exists(to));
  EXPECT_FALSE(std::filesystem::exists(to.string() + ".incomplete"));
}

}  // namespace
}  // namespace esim
