#include "esim/recording/background_sink.h"

#include <gtest/gtest.h>

#include <chrono>

#include "esim/core/error.h"

namespace esim {
namespace {

/// The records that arrived, in order, as text.
struct Log {
  std::vector<std::string> lines;
  int fail_at = -1;  // index of the line that fails
};

class Recorder final : public Sink {
 public:
  explicit Recorder(Log& log) : log_(log) {}
  void begin(const RecordingInfo& info) override { note("begin " + std::to_string(info.end)); }
  void write(const Record& record) override {
    if (const auto* events = std::get_if<EventsRecord>(&record)) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      note("events " + std::to_string(events->events.size()) + " first " + std::to_string(events->events.front().t));
    }
    if (const auto* truth = std::get_if<TruthRecord>(&record))
      note("truth " + std::to_string(truth->t) + " " + std::to_string(truth->depth(1, 0)));
    if (const auto* pose = std::get_if<PoseRecord>(&record)) note("pose " + std::to_string(pose->t));
  }
  void end(bool complete) override { note(complete ? "end complete" : "end incomplete"); }

 private:
  void note(const std::string& line) {
    if (static_cast<int>(log_.lines.size()) == log_.fail_at) throw OutputError("the disk is full");
    log_.lines.push_back(line);
  }
  Log& log_;
};

void write_everything(Sink& sink, int count) {
  RecordingInfo info;
  info.end = 7;
  sink.begin(info);
  for (int i = 0; i < count; ++i) {
    std::vector<Event> events(static_cast<std::size_t>(i % 5 + 1), Event{i, 0, 0, 1});
    sink.write(EventsRecord{0, events});
    Image<float> image(2, 2, 0.5F);
    image(1, 0) = static_cast<float>(i);
    sink.write(TruthRecord{0, i, {}, image, image, image, image});
    sink.write(PoseRecord{i, {}});
    image.fill(-1);  // must not change the copy in the sink
    events.clear();
  }
  sink.end(count % 2 == 0);
}

TEST(BackgroundSink, PassesEverythingOnInOrder) {
  for (const std::size_t capacity : {std::size_t{0}, std::size_t{1000}, std::size_t{1} << 20}) {
    for (const int count : {0, 1, 100}) {
      Log direct, background;
      Recorder recorder(direct);
      write_everything(recorder, count);
      BackgroundSink sink(std::make_unique<Recorder>(background), capacity);
      write_everything(sink, count);
      EXPECT_EQ(background.lines, direct.lines);
    }
  }
}

/// Sums the contents of ground truth.
class Summer final : public Sink {
 public:
  explicit Summer(std::vector<double>& sums) : sums_(sums) {}
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    const auto add = [&](const auto& image) {
      double sum = 0;
      for (const auto value : image.pixels()) sum += value;
      sums_.push_back(sum);
    };
    if (const auto* truth = std::get_if<TruthRecord>(&record)) {
      truth->object ? add(*truth->object) : add(truth->depth);
      for (const SE3& pose : truth->T_world_objects) sums_.push_back(pose.translation.sum());
    }
    if (const auto* part = std::get_if<OpticalFlowRecord>(&record)) {
      add(part->x), add(part->y), add(part->visible);
      sums_.push_back(static_cast<double>(part->t0 + 10 * part->t1));
    }
    if (const auto* part = std::get_if<EventPointsRecord>(&record)) {
      for (std::size_t i = 0; i < part->events.size(); ++i)
        sums_.push_back(double{part->points[i].sum()} + part->events[i].x);
    }
  }
  void end(bool) override {}

 private:
  std::vector<double>& sums_;
};

TEST(BackgroundSink, KeepsCopiesOfGroundTruth) {
  std::vector<double> sums;
  BackgroundSink sink(std::make_unique<Summer>(sums));
  sink.begin({});
  Image<float> image(2, 2, 0.5F), other(2, 2, 0.25F);
  Image<std::uint16_t> object(2, 2, 3);
  Image<std::uint8_t> visible(2, 2, 1);
  std::vector<Event> events = {{1, 7, 0, 1}};
  std::vector<Eigen::Vector3f> points = {{1, 2, 3}};
  sink.write(TruthRecord{0, 1, {}, image, image, image, image});
  std::vector<SE3> poses = {{Eigen::Quaterniond::Identity(), {1, 2, 3}}};
  sink.write(TruthRecord{0, 2, {}, image, image, image, image, &object, poses});
  sink.write(OpticalFlowRecord{0, 1, 2, image, other, visible});
  sink.write(EventPointsRecord{0, events, points});
  image.fill(-1), other.fill(-1), object.fill(9), visible.fill(9);
  points[0].setZero(), poses[0].translation.setZero(), events[0].x = 0;
  sink.end(true);
  EXPECT_EQ(sums, (std::vector<double>{2, 12, 6, 2, 1, 4, 21, 13}));
}

TEST(BackgroundSink, ReportsFailuresOfTheInnerSink) {
  for (const int fail_at : {0, 1, 150, 300, 301}) {
    Log log;
    log.fail_at = fail_at;
    BackgroundSink sink(std::make_unique<Recorder>(log), 500);
    EXPECT_THROW(write_everything(sink, 100), OutputError) << fail_at;
    EXPECT_EQ(static_cast<int>(log.lines.size()), fail_at) << "nothing is written after a failure";
  }
}

TEST(BackgroundSink, MayBeAbandoned) {
  Log log;
  {
    BackgroundSink sink(std::make_unique<Recorder>(log), std::size_t{1} << 20);
    sink.begin({});
    const std::vector<Event> events(3);
    for (int i = 0; i < 1000; ++i) sink.write(EventsRecord{0, events});
  }
  EXPECT_LT(log.lines.size(), 1000U);
}

}  // namespace
}  // namespace esim
