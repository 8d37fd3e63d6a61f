#include "esim/formats/copy_recording.h"

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;

/// A recording in memory: events of two cameras and poses.
class Given final : public Source {
 public:
  Given() {
    info_ = test::recording_info(64, 48, 5 * kNsPerSecond, 6 * kNsPerSecond);
    info_.cameras.push_back(info_.cameras.front());
    info_.cameras.back().name = "right";
    left_ = test::random_events(5000, 64, 48, info_.start, info_.end, 1);
    right_ = test::random_events(3000, 64, 48, info_.start, info_.end, 2);
    PoseRecord pose;
    pose.t = info_.start;
    records_.emplace_back(EventsRecord{0, left_});
    records_.emplace_back(EventsRecord{1, right_});
    for (int i = 0; i < 2; ++i) records_.emplace_back(pose);
  }
  const RecordingInfo& info() const override { return info_; }
  const Record* next() override { return done_ < records_.size() ? &records_[done_++] : nullptr; }
  double progress() const override { return static_cast<double>(done_) / static_cast<double>(records_.size()); }

  RecordingInfo info_;
  std::vector<Event> left_, right_;
  std::vector<Record> records_;
  std::size_t done_ = 0;
};

std::vector<Event> events_in(const std::filesystem::path& path) {
  const auto source = open_source(path);
  std::vector<Event> all;
  while (const Record* record = source->next()) {
    const EventSpan events = std::get<EventsRecord>(*record).events;
    all.insert(all.end(), events.begin(), events.end());
  }
  return all;
}

const auto kGoOn = [](double) { return true; };

TEST(CopyRecording, TakesOneCameraAndSaysWhatIsLeftOut) {
  const test::TemporaryDirectory base;
  Given given;
  const Format& text = format_named("text");
  EXPECT_TRUE(contains(message_of<UserError>([&] { copy_recording(given, text, base.path() / "a", {}, kGoOn); }),
                       "cam0, right: choose one"));
  EXPECT_TRUE(contains(
      message_of<UserError>([&] { copy_recording(given, text, base.path() / "a", {.camera = "left"}, kGoOn); }),
      "no camera left; its cameras are cam0, right"));
  const CopySummary summary = copy_recording(given, text, base.path() / "a", {.camera = "right"}, kGoOn);
  EXPECT_EQ(summary.copied, (std::map<Content, std::uint64_t>{{Content::events, 3000}}));
  EXPECT_EQ(summary.left_out, (std::map<Content, std::uint64_t>{{Content::poses, 2}}));
  EXPECT_EQ(losses(summary, text), std::vector<Loss>{{"text cannot hold poses: 2 left out"}});
  EXPECT_EQ(events_in(base.path() / "a"), given.right_);
}

TEST(CopyRecording, SaysThatTimesAreRounded) {
  const test::TemporaryDirectory base;
  const Format& dsec = format_named("dsec");
  Given given, again;
  CopyOptions options{.camera = "cam0"};
  const CopySummary rounded = copy_recording(given, dsec, base.path() / "us", options, kGoOn);
  EXPECT_EQ(rounded.rounded_to, kNsPerUs);
  EXPECT_EQ(losses(rounded, dsec).back().remedy, Remedy::nanoseconds);
  options.write.unit = TimeUnit::ns;
  EXPECT_EQ(copy_recording(again, dsec, base.path() / "ns", options, kGoOn).rounded_to, 0);
  EXPECT_EQ(events_in(base.path() / "ns"), given.left_);
}

TEST(CopyRecording, TimesMayCountFromTheStart) {
  const test::TemporaryDirectory base;
  Given given;
  copy_recording(given, format_named("text"), base.path() / "a", {.camera = "cam0", .from_zero = true}, kGoOn);
  std::vector<Event> expected = given.left_;
  for (Event& event : expected) event.t -= given.info_.start;
  EXPECT_EQ(events_in(base.path() / "a"), expected);
}

// A conversion leaves a report.json in its folders, which must keep their format.
TEST(ConvertRecording, FoldersOfEveryFormatReadBack) {
  const test::TemporaryDirectory base;
  const std::filesystem::path recording = base.path() / "source";
  {
    const auto sink = format_named("recording").create(recording, {});
    sink->begin(test::recording_info(32, 24, 0, kNsPerSecond));
    const std::vector<Event> events = test::random_events(100, 32, 24, 0, kNsPerSecond);
    sink->write(EventsRecord{0, events});
    for (int i = 0; i < 3; ++i) sink->write(test::TruthImages(32, 24, 0.1 * i).at(i * kNsPerMs));
    sink->end(true);
  }
  for (const Format& format : all_formats()) {
    if (!format.folder || !format.create) continue;
    const auto to = base.path() / format.name;
    const CopySummary there = convert_recording(recording, format, to, {}, kGoOn);
    EXPECT_FALSE(there.copied.empty()) << format.name;
    ASSERT_TRUE(std::filesystem::exists(to / "report.json")) << format.name;
    const Format& found = format_of(to);
    EXPECT_TRUE(found.name == format.name || !format.recognises) << found.name;
    std::size_t records = 0;
    const auto source = open_source(to);
    while (source->next() != nullptr) ++records;
    EXPECT_GT(records, 0U) << format.name;
  }
}

TEST(CopyRecording, StoppedItEndsInOrder) {
  const test::TemporaryDirectory base;
  Given given;
  const CopySummary summary = copy_recording(given, format_named("dsec"), base.path() / "a", {.camera = "cam0"},
                                             [](double share) { return share < 0.2; });
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(events_in(base.path() / "a").size(), 5000U);
}

}  // namespace
}  // namespace esim
