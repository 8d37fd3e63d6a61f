// Several event sensors of a camera, as scenarios describe them.
#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;

constexpr const char* kMinimal =
    "duration_s: 1\nrenderer: {type: panorama, image: p.jpg}\ntrajectory: {type: static}\n";

class EventCameras : public testing::Test {
 protected:
  Scenario read(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
    std::ofstream(folder_.path() / "s.yaml") << kMinimal << yaml;
    return read_scenario(folder_.path() / "s.yaml", overrides);
  }
  std::vector<SensorOptions> sensors(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
    const Scenario scenario = read(yaml, overrides);
    const auto all = scenario.cameras[0].sensors();
    return {all.begin(), all.end()};
  }
  std::string error(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
    const std::string message = test::message_of<UserError>([&] { read(yaml, overrides); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << "more than a line: " << message;
    return message;
  }
  static std::vector<std::string> names(const std::vector<SensorOptions>& sensors) {
    std::vector<std::string> names;
    for (const SensorOptions& sensor : sensors) names.push_back(sensor.name);
    return names;
  }

  test::TemporaryDirectory folder_;
};

using Names = std::vector<std::string>;

TEST_F(EventCameras, AreOneWithoutAName) {
  for (const char* yaml : {"", "event_camera: {contrast_threshold: 0.2, seed: 4}", "camera: {event_camera: {}}"})
    EXPECT_EQ(names(sensors(yaml)), Names{""}) << yaml;
  EXPECT_EQ(sensors("event_camera: {seed: 4}")[0].seed, 4U);
  EXPECT_TRUE(sensors("camera: {events: false}").empty());
}

TEST_F(EventCameras, AreAListThatInheritsFromEventCamera) {
  const auto all = sensors(
      "event_camera: {preset: dvs128@1, contrast_threshold_on: 0.25}\n"
      "event_cameras:\n- {name: low, contrast_threshold_on: 0.1}\n- {preset: ideal, seed: 9}\n- {}\n");
  EXPECT_EQ(names(all), (Names{"low", "sensor1", "sensor2"}));
  EXPECT_EQ(all[0].preset.name(), "dvs128@1");
  EXPECT_EQ(all[0].threshold_on(), 0.1);
  EXPECT_EQ(all[1].preset.name(), "ideal");
  EXPECT_EQ(all[1].threshold_on(), 0.25);
  EXPECT_EQ(all[1].seed, 9U);
  EXPECT_EQ(all[2].threshold_on(), 0.25);
  EXPECT_FALSE(all[0].seed);
  EXPECT_EQ(names(sensors("event_cameras: [{}, {}]", {"event_cameras=null"})), Names{""});
  // Only one is in a folder of its own, too.
  EXPECT_EQ(names(sensors("event_cameras: [{}]")), Names{"sensor0"});
  // For each camera, or for one of them.
  const Scenario rig = read("event_cameras: [{}, {}]\ncameras:\n- {}\n- {event_cameras: [{name: only}]}\n");
  EXPECT_EQ(rig.cameras[0].sensors().size(), 2U);
  EXPECT_EQ(rig.cameras[1].sensors()[0].name, "only");
}

TEST_F(EventCameras, AreAGrid) {
  const auto all = sensors(
      "event_camera: {contrast_threshold: {values: [0.1, 0.2]}, readout: {rate_mev_per_s: {values: [0, 1, 2]}}}\n");
  EXPECT_EQ(names(all), (Names{"sensor0", "sensor1", "sensor2", "sensor3", "sensor4", "sensor5"}));
  EXPECT_EQ(all[2].contrast_threshold, 0.1);
  EXPECT_EQ(all[2].readout.rate_mev_per_s, 2);
  EXPECT_EQ(all[3].contrast_threshold, 0.2);
  EXPECT_EQ(all[3].readout.rate_mev_per_s, 0);
  ASSERT_EQ(all[3].varied.size(), 2U);
  EXPECT_EQ(all[3].varied[0].key, "contrast_threshold");
  EXPECT_EQ(all[3].varied[0].value, "0.2");
  EXPECT_EQ(all[3].varied[1].key, "readout.rate_mev_per_s");
  EXPECT_FALSE(all[3].seed) << "differences come from the options alone";

  const auto seeds = sensors("event_camera: {seed: {values: [1, 2]}, preset: {values: [ideal, davis346]}}");
  EXPECT_EQ(seeds[3].seed, 2U);
  EXPECT_EQ(seeds[1].preset.sensor, "davis346");
  EXPECT_TRUE(seeds[1].circuit);
  EXPECT_EQ(names(sensors("event_cameras: [{name: {values: [x, y]}}]")), (Names{"x", "y"}));
  EXPECT_EQ(names(sensors("event_cameras: [{name: a, log_eps: {values: [0.1, 0.2]}}, {name: b}]")),
            (Names{"a0", "a1", "b"}));
  EXPECT_EQ(sensors("", {"event_camera.contrast_threshold={values: [0.1, 0.3]}"})[1].contrast_threshold, 0.3);
}

TEST_F(EventCameras, AreDrawnFromDistributionsBySeed) {
  const std::string yaml = "event_camera: {count: 50, contrast_threshold: {uniform: [0.1, 0.5]}}\n";
  const auto all = sensors(yaml);
  ASSERT_EQ(all.size(), 50U);
  std::set<double> thresholds;
  std::set<std::uint64_t> seeds;
  double sum = 0;
  for (const SensorOptions& sensor : all) {
    EXPECT_GE(sensor.contrast_threshold, 0.1);
    EXPECT_LE(sensor.contrast_threshold, 0.5);
    thresholds.insert(sensor.contrast_threshold);
    seeds.insert(sensor.seed.value());
    sum += sensor.contrast_threshold;
  }
  EXPECT_EQ(thresholds.size(), 50U);
  EXPECT_EQ(seeds.size(), 50U);
  EXPECT_NEAR(sum / 50, 0.3, 4 * 0.4 / std::sqrt(12 * 50));
  EXPECT_EQ(sensors(yaml)[7].contrast_threshold, all[7].contrast_threshold);
  EXPECT_NE(sensors(yaml, {"seed=2"})[7].contrast_threshold, all[7].contrast_threshold);
  // Fewer sensors are the first of more.
  EXPECT_EQ(sensors(yaml, {"event_camera.count=8"})[7].contrast_threshold, all[7].contrast_threshold);
  // Each option and each camera draws independently.
  const Scenario rig = read(
      "event_camera: {count: 2, contrast_threshold: {uniform: [0.1, 0.5]}, log_eps: {uniform: [0.1, 0.5]}}\n"
      "cameras: [{}, {}]\n");
  EXPECT_NE(rig.cameras[0].sensors()[0].contrast_threshold, rig.cameras[0].sensors()[0].log_eps);
  EXPECT_NE(rig.cameras[0].sensors()[0].contrast_threshold, rig.cameras[1].sensors()[0].contrast_threshold);
  // One sensor with a random option is still the only one.
  EXPECT_EQ(names(sensors("event_camera: {contrast_threshold: {log_uniform: [0.1, 0.5]}}")), Names{""});
  EXPECT_EQ(sensors("event_camera: {count: 2, seed: 3}")[1].seed, 3U);
}

TEST_F(EventCameras, AreWrittenExplicitly) {
  const Scenario scenario = read(
      "event_camera: {preset: davis346}\n"
      "cameras:\n- event_camera: {count: 3, contrast_threshold_on: {uniform: [0.1, 0.5]}}\n- {event_camera: {preset: "
      "dvs128@1}, event_cameras: [{name: a}]}\n- {event_camera: {seed: 2}}\n");
  const std::string text = write_scenario(scenario);
  std::ofstream(folder_.path() / "again.yaml") << text;
  const Scenario again = read_scenario(folder_.path() / "again.yaml");
  EXPECT_EQ(write_scenario(again), text);
  ASSERT_EQ(again.cameras[0].event_cameras.size(), 3U);
  EXPECT_EQ(again.cameras[0].event_cameras[2].seed, scenario.cameras[0].event_cameras[2].seed);
  EXPECT_EQ(again.cameras[0].event_cameras[2].contrast_threshold_on,
            scenario.cameras[0].event_cameras[2].contrast_threshold_on);
  EXPECT_TRUE(again.cameras[0].event_cameras[2].circuit);
  EXPECT_EQ(again.cameras[1].event_cameras[0].name, "a");
  EXPECT_FALSE(again.cameras[1].event_cameras[0].circuit);
}

TEST_F(EventCameras, AreRefusedWithThePlaceAndTheReason) {
  EXPECT_TRUE(
      contains(error("event_cameras: {low: {}}"), "s.yaml:4: camera.event_cameras: must be a list of at least"));
  EXPECT_TRUE(contains(error("event_cameras: []"), "must be a list of at least one sensor"));
  EXPECT_TRUE(contains(error("event_cameras: [3]"), "camera.event_cameras.0: must be a map"));
  EXPECT_TRUE(contains(error("event_cameras:\n- {}\n- {contrast_treshold: 1}"),
                       "s.yaml:6: camera.event_cameras.1.contrast_treshold: unknown key; did you mean"));
  EXPECT_TRUE(contains(error("event_cameras: [{name: a/b}]"), "sensor name 'a/b': must consist of letters"));
  EXPECT_TRUE(contains(error("event_cameras: [{name: ..}]"), "must consist of letters"));
  EXPECT_TRUE(contains(error("event_cameras: [{name: images}]"), "is the name of another folder"));
  EXPECT_TRUE(contains(error("event_cameras: [{name: a}, {name: a}]"), "two event sensors are named a; rename one"));
  EXPECT_TRUE(contains(error("event_cameras: [{name: sensor1}, {}]"), "two event sensors are named sensor1"));
  EXPECT_TRUE(contains(error("event_camera: {count: 0}"), "camera.event_camera.count: 0 is out of range"));
  EXPECT_TRUE(contains(error("event_camera: {count: 257}"), "257 is out of range"));
  EXPECT_TRUE(contains(error("event_camera: {count: 20, log_eps: {values: [1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3, 7e-3, "
                             "8e-3, 9e-3, 1e-2, 2e-2, 3e-2, 4e-2]}}"),
                       "at most 256 event sensors"));
  EXPECT_TRUE(contains(error("event_camera: {contrast_threshold: {values: []}}"), "values: must be a list"));
  EXPECT_TRUE(contains(error("event_camera:\n  contrast_threshold: {values: [0.1,\n    -1]}"),
                       "s.yaml:6: camera.event_camera.contrast_threshold: -1 is out of range"));
  EXPECT_TRUE(contains(error("event_camera: {contrast_threshold: {uniform: [1]}}"),
                       "s.yaml:4: camera.event_camera.contrast_threshold: must be a list of two numbers"));
  EXPECT_TRUE(contains(error("event_camera: {contrast_threshold: {uniform: [0.1, 1], values: [1]}}"), "one key of"));
  EXPECT_TRUE(contains(error("event_camera: {contrast_threshold: {uniform: [-3, -2]}}"),
                       "s.yaml: camera.event_camera.contrast_threshold: "));
  EXPECT_TRUE(
      contains(error("event_cameras: [{name: f, filters: {region: {windows: [{x: 400}]}}}]"), "f: filters.region"));
  EXPECT_TRUE(contains(error("", {"event_cameras.0.count=2"}), "event_cameras"));
}

}  // namespace
}  // namespace esim
