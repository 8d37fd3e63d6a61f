// The filters of a scenario's sensor against the same filters on the unfiltered events.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "esim/compose/compose.h"
#include "esim/filters/filter_chain.h"
#include "esim/sim/simulate.h"
#include "sim/blobs.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;

constexpr int kWidth = 48, kHeight = 32;

FilterOptions everything() {
  FilterOptions options;
  options.region = RegionFilterOptions{false, {{2, 1, 45, 30}}, {{5, 5}, {20, 9}}};
  options.activity = ActivityFilterOptions{1000, 5e4, 2.5e4, 0, 0};
  options.anti_flicker = AntiFlickerOptions{FlickerMode::band_stop, 50, 5000, 2, 1};
  options.trail = TrailFilterOptions{TrailType::stc_keep_trail, 20'000};
  options.rate_controller = RateControllerOptions{1000, 40};
  return options;
}

struct Case {
  const char* name;
  FilterOptions filters;
};

std::vector<Case> cases() {
  const FilterOptions all = everything();
  return {{"region", {.region = all.region}},
          {"activity", {.activity = all.activity}},
          {"anti_flicker", {.anti_flicker = all.anti_flicker}},
          {"trail", {.trail = TrailFilterOptions{}}},
          {"rate_controller", {.rate_controller = all.rate_controller}},
          {"all", all}};
}

/// Keeps the events and their points.
class Collector final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override { events.resize(recording.cameras.size()); }
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record)) {
      auto& to = events[static_cast<std::size_t>(part->camera)];
      to.insert(to.end(), part->events.begin(), part->events.end());
      ++records;
    }
    if (const auto* part = std::get_if<EventPointsRecord>(&record)) {
      with_points.insert(with_points.end(), part->events.begin(), part->events.end());
      points += part->points.size();
    }
  }
  void end(bool) override {}

  std::vector<std::vector<Event>> events;
  std::vector<Event> with_points;
  std::size_t points = 0, records = 0;
};

/// A textured plane before two shaking cameras with noise and a slow readout.
class SensorFilters : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    test::write_blobs(folder_.path() / "p.png", 128);
    RandomTrajectoryOptions motion;
    motion.rotation_amplitude_deg = {10, 20, 15};
    scenario_.trajectory = motion;
    PlaneRendererOptions plane;
    plane.image = folder_.path() / "p.png";
    plane.endless = true;
    plane.pose.position = {2, 0, 0};
    plane.pose.look_at = {3, 0, 0};
    scenario_.renderer = plane;
    scenario_.duration_s = 0.2;
    CameraOptions camera;
    camera.width = kWidth, camera.height = kHeight;
    EventCameraOptions& sensor = camera.event_camera;
    sensor.contrast_threshold = 0.1;
    sensor.leak_rate_hz = 5;
    sensor.shot_noise_hz = 20;
    sensor.latency_us = 300;
    sensor.latency_jitter_us = 100;
    sensor.readout.rate_mev_per_s = 3;
    sensor.readout.row_time_us = 1;
    camera.name = "left";
    scenario_.cameras.push_back(camera);
    camera.name = "right";
    scenario_.cameras.push_back(camera);
  }

  Summary run(Collector& out, int threads = 1) {
    World world = build_world(scenario_, threads,
                              {[&](const std::string& text) { warnings_.push_back(text); }, [](const std::string&) {}});
    return simulate(world, out, [](const Progress&) { return true; });
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_;
  std::vector<std::string> warnings_;
};

TEST_P(SensorFilters, GiveTheSameEventsAsFilteringAfterwards) {
  Collector unfiltered;
  run(unfiltered);
  for (CameraOptions& camera : scenario_.cameras) camera.event_camera.filters = GetParam().filters;
  std::size_t fewest = unfiltered.records, most = 0;
  for (const double truth_rate_hz : {0.0, 30.0, 1711.0}) {
    scenario_.truth.rate_hz = truth_rate_hz;  // divides the stream of events into records of other sizes
    for (const int threads : {1, 2}) {
      Collector out;
      const Summary summary = run(out, threads);
      fewest = std::min(fewest, out.records), most = std::max(most, out.records);
      for (const std::size_t i : {0U, 1U}) {
        FilterChain chain(GetParam().filters, kWidth, kHeight);
        std::vector<Event> expected;
        chain.process(unfiltered.events[i], expected);
        EXPECT_EQ(out.events[i], expected);
        EXPECT_GT(expected.size(), 100U);
        const CameraSummary& camera = summary.cameras[i];
        EXPECT_EQ(camera.sensors[0].statistics.read_out, static_cast<std::int64_t>(unfiltered.events[i].size()));
        EXPECT_EQ(camera.events(), static_cast<std::int64_t>(expected.size()));
        ASSERT_EQ(camera.sensors[0].statistics.filtered.size(), chain.dropped().size());
        for (std::size_t k = 0; k < chain.dropped().size(); ++k) {
          EXPECT_EQ(camera.sensors[0].statistics.filtered[k].filter, chain.dropped()[k].filter);
          EXPECT_EQ(camera.sensors[0].statistics.filtered[k].events, chain.dropped()[k].events);
          EXPECT_GT(chain.dropped()[k].events, 0U) << chain.dropped()[k].filter;
        }
      }
    }
  }
  EXPECT_GT(most, fewest);
  EXPECT_TRUE(warnings_.empty());
}

INSTANTIATE_TEST_SUITE_P(Each, SensorFilters, testing::ValuesIn(cases()),
                         [](const auto& instance) { return std::string(instance.param.name); });

using FilteredSensor = SensorFilters;

TEST_F(FilteredSensor, PointsBelongToTheEventsThatPass) {
  scenario_.truth.event_points = true;
  scenario_.cameras.resize(1);
  scenario_.cameras[0].event_camera.filters = everything();
  Collector out;
  run(out);
  EXPECT_EQ(out.with_points, out.events[0]);
  EXPECT_EQ(out.points, out.events[0].size());
}

TEST_F(FilteredSensor, TheReportCountsWhatEachFilterDropped) {
  scenario_.cameras[1].event_camera.filters = everything();
  Collector out;
  const Summary summary = run(out);
  const auto report = nlohmann::json::parse(report_json(scenario_, summary, 1, {}));
  ASSERT_EQ(report["filtered"].size(), 1U) << "only one camera has filters";
  const auto& right = report["filtered"][0];
  EXPECT_EQ(right["name"], "right");
  EXPECT_EQ(right["events"].get<std::size_t>(),
            static_cast<std::size_t>(summary.cameras[1].sensors[0].statistics.read_out));
  EXPECT_EQ(right["kept"].get<std::size_t>(), out.events[1].size());
  EXPECT_EQ(right["dropped"].size(), 5U);
  EXPECT_EQ(report["cameras"][1]["events"].get<std::size_t>(), out.events[1].size());
  scenario_.cameras[1].event_camera.filters = {};
  Collector unfiltered;
  EXPECT_FALSE(nlohmann::json::parse(report_json(scenario_, run(unfiltered), 1, {})).contains("filtered"));
}

// The fractions in these warnings are of the events that left the readout, not of those that passed the filters.
TEST_F(FilteredSensor, LossesOfTheReadoutDoNotDependOnTheFilters) {
  scenario_.cameras.resize(1);
  ReadoutOptions& readout = scenario_.cameras[0].event_camera.readout;
  readout.rate_mev_per_s = 0.3;
  readout.queue_events = 20;
  Collector unfiltered, filtered;
  const std::vector<std::string> expected = losses(scenario_, run(unfiltered));
  ASSERT_FALSE(expected.empty());
  scenario_.cameras[0].event_camera.filters = everything();
  EXPECT_EQ(losses(scenario_, run(filtered)), expected);
}

TEST_F(FilteredSensor, WarnsOfFiltersThatTheSensorDoesNotHave) {
  scenario_.cameras[0].event_camera.preset = *SensorPreset::find("davis346");
  scenario_.cameras[0].event_camera.filters.anti_flicker.emplace();
  scenario_.cameras[0].event_camera.filters.region = everything().region;
  scenario_.cameras[1].event_camera.preset = *SensorPreset::find("imx636");
  scenario_.cameras[1].event_camera.filters.anti_flicker.emplace();
  Collector out;
  run(out);
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_EQ(warnings_[0],
            "camera left: event_camera.filters.anti_flicker: the davis346 has no such filter, but these have: gen4.1, "
            "imx636, genx320; it is applied anyway");
  warnings_.clear();
  scenario_.cameras[0].events = false;
  run(out);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(FilteredSensor, RefusesRegionsOutsideTheSensor) {
  scenario_.cameras[0].event_camera.filters.region = RegionFilterOptions{false, {{kWidth, 0, 3, 3}}, {}};
  Collector out;
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { run(out); }),
                       "event_camera.filters.region.windows.0: (48, 0) lies outside the sensor of 48 x 32 px"));
}

}  // namespace
}  // namespace esim
