// New events of a part of a recording, against those of all of it.
#include "esim/compose/samples/sensor_preview.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/scenario/read.h"
#include "sim/blobs.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr TimeNs kSecond = kNsPerSecond;

std::vector<Event> between(const std::vector<Event>& events, TimeNs from, TimeNs to) {
  std::vector<Event> found;
  std::ranges::copy_if(events, std::back_inserter(found),
                       [&](const Event& event) { return event.t >= from && event.t <= to; });
  return found;
}

class SensorPreviewTest : public testing::Test {
 protected:
  /// A recording of 3 s from 1 s on, with samples.
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryDirectory;
    test::write_blobs(folder_->path() / "p.png", 256);
    std::ofstream(folder_->path() / "s.yaml")
        << "renderer: {type: panorama, image: p.png}\n"
           "trajectory: {type: random, rotation_amplitude_deg: [20, 40, 30]}\n"
           "start_s: 1\nduration_s: 3\ncamera: {width: 60, height: 40}\ntruth: {rate_hz: 20}\n"
           "sampling: {type: flow, lambda: 0.1}\noutput: {time_unit: ns}\n";
    simulate("one", {"output.samples=exact"});
    simulate("several", {"output.samples=exact", "event_camera.contrast_threshold={values: [0.2, 0.4]}"});
    simulate("without", {});
  }
  static void TearDownTestSuite() { delete folder_; }

  static void simulate(const std::string& name, const std::vector<std::string>& overrides) {
    const Scenario scenario = read_scenario(folder_->path() / "s.yaml", overrides);
    make_recording(scenario, {.out = folder_->path() / name, .threads = 2}, quiet(),
                   [](const Progress&) { return true; });
  }
  static Notices quiet() {
    return {[](const std::string&) {}, [](const std::string&) {}};
  }

  /// All events of the changed sensor.
  static std::vector<Event> resensed(const std::string& name, std::vector<std::string> overrides,
                                     const std::string& camera = "cam0") {
    const fs::path out = folder_->path() / "resensed";
    resense({.recording = folder_->path() / name, .out = out, .replace = true, .overrides = std::move(overrides)},
            quiet(), [](const Progress&) { return true; });
    std::vector<Event> events;
    const auto source = format_named("recording").open(out, {});
    const auto wanted = std::ranges::find(source->info().cameras, camera, &CameraInfo::name);
    EXPECT_NE(wanted, source->info().cameras.end());
    while (const Record* const record = source->next()) {
      const auto* const packet = std::get_if<EventsRecord>(record);
      if (packet == nullptr || packet->camera != wanted - source->info().cameras.begin()) continue;
      events.insert(events.end(), packet->events.begin(), packet->events.end());
    }
    return events;
  }

  static SensorPreview preview(const std::string& name, std::vector<std::string> overrides,
                               const std::string& camera = "cam0") {
    return SensorPreview({.recording = folder_->path() / name, .camera = camera, .overrides = std::move(overrides)});
  }

  static inline test::TemporaryDirectory* folder_ = nullptr;
  const std::function<bool()> always_ = [] { return true; };
};

TEST_F(SensorPreviewTest, HasTheEventsOfAllSamplesIfItBeginsWithThem) {
  for (const std::vector<std::string>& change :
       {std::vector<std::string>{}, {"event_camera.contrast_threshold=0.15"}, {"event_camera.preset=davis346"}}) {
    const TimeNs to = change.empty() || change[0].find("davis") == std::string::npos ? 3 * kSecond : kSecond * 21 / 20;
    const std::vector<Event> all = resensed("one", change);
    SensorPreview sensor = preview("one", change);
    EXPECT_EQ(sensor.inexact(), "");
    const std::vector<Event> expected = between(all, kSecond, to);
    EXPECT_GT(expected.size(), 300U);
    EXPECT_TRUE(sensor.events(kSecond, to, always_) == expected);
    EXPECT_TRUE(sensor.events(kSecond + kNsPerMs, to, always_) == between(all, kSecond + kNsPerMs, to));
  }
  SensorPreview sensor = preview("one", {});
  EXPECT_TRUE(sensor.events(0, 10 * kSecond, always_) == resensed("one", {}));
}

TEST_F(SensorPreviewTest, HasAlmostAsManyEventsIfItBeginsLater) {
  const std::vector<Event> all = resensed("one", {"event_camera.contrast_threshold=0.2"});
  SensorPreview sensor = preview("one", {"event_camera.contrast_threshold=0.2"});
  for (const TimeNs from : {3 * kSecond, 2 * kSecond, kSecond * 7 / 2}) {
    const auto expected = static_cast<double>(between(all, from, from + kSecond / 2).size());
    const auto found = static_cast<double>(sensor.events(from, from + kSecond / 2, always_).size());
    EXPECT_GT(expected, 1000);
    EXPECT_NEAR(found / expected, 1, 0.03) << from;
  }
}

TEST_F(SensorPreviewTest, ContinuesAndGoesBack) {
  SensorPreview sensor = preview("one", {"event_camera.contrast_threshold=0.2"});
  const std::vector<Event> first = sensor.events(3 * kSecond, kSecond * 16 / 5, always_);
  const std::vector<Event> next = sensor.events(kSecond * 16 / 5, kSecond * 17 / 5, always_);
  SensorPreview other = preview("one", {"event_camera.contrast_threshold=0.2"});
  const std::vector<Event> both = other.events(3 * kSecond, kSecond * 17 / 5, always_);
  EXPECT_GT(first.size(), 300U);
  EXPECT_TRUE(between(both, 3 * kSecond, kSecond * 16 / 5) == first);
  EXPECT_TRUE(between(both, kSecond * 16 / 5, kSecond * 17 / 5) == next);
  sensor.events(2 * kSecond, 2 * kSecond + kNsPerMs, always_);
  EXPECT_TRUE(sensor.events(3 * kSecond, kSecond * 16 / 5, always_) == first);
  EXPECT_TRUE(sensor.events(9 * kSecond, 10 * kSecond, always_).empty());
  EXPECT_TRUE(sensor.events(3 * kSecond, kSecond * 16 / 5, always_) == first);
}

TEST_F(SensorPreviewTest, StopsOnRequest) {
  SensorPreview sensor = preview("one", {});
  int calls = 0;
  EXPECT_TRUE(sensor.events(3 * kSecond, 4 * kSecond, [&] { return ++calls < 3; }).empty());
  EXPECT_EQ(calls, 3);
  EXPECT_FALSE(sensor.events(3 * kSecond, 4 * kSecond, always_).empty());
}

TEST_F(SensorPreviewTest, ShowsOneOfSeveralSensors) {
  SensorPreview sensor = preview("several", {}, "cam0/sensor1");
  EXPECT_TRUE(sensor.events(kSecond, 4 * kSecond, always_) == resensed("several", {}, "cam0/sensor1"));
  SensorPreview changed = preview("several", {"event_camera.contrast_threshold=0.3"}, "cam0/sensor0");
  EXPECT_DOUBLE_EQ(changed.scenario().cameras[0].first_sensor().contrast_threshold, 0.3);
}

TEST_F(SensorPreviewTest, RefusesWhatItCannotShow) {
  const auto error = [&](const std::string& name, std::vector<std::string> overrides, const std::string& camera) {
    return test::message_of<UserError>([&] { preview(name, std::move(overrides), camera); });
  };
  EXPECT_TRUE(test::contains(error("without", {}, "cam0"), "the recording has no samples"));
  EXPECT_TRUE(test::contains(error("one", {}, "cam1"), "cam1: scenario.yaml has no such event camera"));
  EXPECT_TRUE(test::contains(error("several", {}, "cam0/other"), "has no such event sensor"));
  EXPECT_TRUE(test::contains(error("one", {"seed=3"}, "cam0"), "cannot be changed without rendering again"));
  EXPECT_TRUE(test::contains(error("one", {"event_camera.contrast_threshold=-1"}, "cam0"), "contrast_threshold"));
}

}  // namespace
}  // namespace esim
