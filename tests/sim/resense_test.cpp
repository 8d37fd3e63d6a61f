// New events from the samples of a recording, against complete simulations.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/formats/formats.h"
#include "esim/scenario/read.h"
#include "sim/blobs.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

using test::contains;

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  EXPECT_TRUE(stream) << file;
  return {std::istreambuf_iterator<char>(stream), {}};
}

class Resense : public testing::Test {
 protected:
  void SetUp() override { test::write_blobs(folder_.path() / "p.png", 256); }

  static constexpr const char* kScene =
      "renderer: {type: panorama, image: p.png}\n"
      "trajectory: {type: random, rotation_amplitude_deg: [20, 40, 30]}\n"
      "duration_s: 0.15\nstart_s: 0.1\ncamera: {width: 40, height: 30}\ntruth: {rate_hz: 20}\n";

  /// Simulates kScene with further options into the folder `name`.
  fs::path simulate(const std::string& name, const std::string& yaml, std::vector<std::string> overrides = {}) {
    std::ofstream(folder_.path() / "s.yaml") << kScene << yaml;
    const Scenario scenario = read_scenario(folder_.path() / "s.yaml", overrides);
    const fs::path out = folder_.path() / name;
    make_recording(scenario, {.out = out, .threads = 2}, quiet_, [](const Progress&) { return true; });
    return out;
  }

  Resensed resense_into(const fs::path& recording, const std::string& name, std::vector<std::string> overrides = {},
                        int threads = 2) {
    notices_.clear();
    const auto keep = [&](const std::string& text) { notices_ += text + "\n"; };
    return resense({.recording = recording,
                    .out = folder_.path() / name,
                    .replace = true,
                    .threads = threads,
                    .overrides = std::move(overrides)},
                   {keep, keep}, [](const Progress&) { return true; });
  }

  std::string error(const fs::path& recording, std::vector<std::string> overrides = {}) {
    return test::message_of<UserError>([&] { resense_into(recording, "refused", overrides); });
  }

  void expect_same_events(const fs::path& one, const fs::path& other) {
    EXPECT_TRUE(content_of(one / "events.h5") == content_of(other / "events.h5")) << one << " " << other;
  }

  test::TemporaryDirectory folder_;
  std::string notices_;
  Notices quiet_{[](const std::string&) {}, [](const std::string&) {}};
};

constexpr const char* kExact = "output.samples=exact";

TEST_F(Resense, HasTheEventsOfASimulationWithTheSameSensor) {
  for (const std::string sampling : {"flow", "uniform", "adaptive"}) {
    SCOPED_TRACE(sampling);
    const std::string yaml = "sampling: {type: " + sampling + "}\nevent_camera: {contrast_threshold: 0.1, " +
                             "threshold_mismatch: 0.05, readout: {rate_mev_per_s: 1}}\n";
    const fs::path recording = simulate("kept_" + sampling, yaml, {kExact});
    for (const int threads : {1, 3}) {
      const Resensed again = resense_into(recording, "again", {}, threads);
      EXPECT_TRUE(again.exact);
      EXPECT_TRUE(again.summary.complete);
      EXPECT_TRUE(contains(notices_, "exactly those of a simulation"));
      expect_same_events(folder_.path() / "again" / "cam0", recording / "cam0");
    }
    EXPECT_FALSE(fs::exists(folder_.path() / "again" / "cam0" / "truth.h5"));
    // The store changes no event.
    expect_same_events(simulate("without_" + sampling, yaml) / "cam0", recording / "cam0");
  }
}

TEST_F(Resense, HasTheEventsOfASimulationWithOtherSensors) {
  const fs::path recording =
      simulate("kept", "sampling: {type: flow}\nevent_camera: {contrast_threshold: 0.3}\n", {kExact});
  const std::vector<std::vector<std::string>> changes = {
      {"event_camera.contrast_threshold=0.1"},
      {"event_camera.contrast_threshold=0.2", "event_camera.seed=9", "event_camera.threshold_mismatch=0.1"},
      {"event_camera.preset=davis346", "light.white_lux=50"},
      {"event_camera.preset=dvs128@1", "event_camera.contrast_threshold=0.12"},
  };
  for (const std::vector<std::string>& change : changes) {
    SCOPED_TRACE(change.front());
    EXPECT_TRUE(resense_into(recording, "again", change).exact);
    std::vector<std::string> full = change;
    if (change.front().find("preset") != std::string::npos) full.insert(full.begin(), "event_camera={}");
    fs::remove_all(folder_.path() / "full");
    expect_same_events(
        folder_.path() / "again" / "cam0",
        simulate("full", "sampling: {type: flow}\nevent_camera: {contrast_threshold: 0.3}\n", full) / "cam0");
  }
  // Several sensors from one, and one from several.
  const std::string grid = "event_camera.contrast_threshold={values: [0.1, 0.2]}";
  EXPECT_TRUE(resense_into(recording, "grid", {grid, kExact}).exact);
  const fs::path full_grid = simulate("full_grid", "sampling: {type: flow}\n", {grid, kExact});
  for (const char* sensor : {"sensor0", "sensor1"})
    expect_same_events(folder_.path() / "grid" / "cam0" / sensor, full_grid / "cam0" / sensor);
  EXPECT_TRUE(resense_into(full_grid, "one", {"event_camera={contrast_threshold: 0.15}"}).exact);
  fs::remove_all(folder_.path() / "full");
  expect_same_events(folder_.path() / "one" / "cam0",
                     simulate("full", "sampling: {type: flow}\nevent_camera: {contrast_threshold: 0.15}\n") / "cam0");
  EXPECT_TRUE(resense_into(full_grid, "both", {"event_camera.threshold_mismatch=0.1"}).exact);
  EXPECT_TRUE(fs::exists(folder_.path() / "both" / "cam0" / "sensor1" / "events.h5"));
  // Its scenario simulates the same.
  const Scenario scenario = read_scenario(folder_.path() / "grid" / "scenario.yaml");
  make_recording(scenario, {.out = folder_.path() / "by_scenario"}, quiet_, [](const Progress&) { return true; });
  expect_same_events(folder_.path() / "by_scenario" / "cam0" / "sensor1", full_grid / "cam0" / "sensor1");
}

TEST_F(Resense, ContainsTheFlickerOfTheLight) {
  const std::string yaml =
      "sampling: {type: flow}\nlight: {flicker: {frequency_hz: 100}}\nevent_camera: {contrast_threshold: 0.2}\n";
  const fs::path recording = simulate("kept", yaml, {kExact});
  EXPECT_TRUE(resense_into(recording, "again", {"event_camera.leak_rate_hz=1"}).exact);
  expect_same_events(folder_.path() / "again" / "cam0",
                     simulate("full", yaml, {"event_camera.leak_rate_hz=1"}) / "cam0");
  EXPECT_FALSE(resense_into(recording, "again", {"event_camera.contrast_threshold=0.1"}).exact);
  EXPECT_TRUE(contains(notices_, "flickering light"));
  EXPECT_TRUE(
      contains(error(recording, {"event_camera.labels=true"}), "event_camera.labels: the samples contain neither"));
}

TEST_F(Resense, SaysWhereTheEventsDiffer) {
  const std::string yaml = "sampling: {type: adaptive}\nevent_camera: {contrast_threshold: 0.2}\n";
  const fs::path recording = simulate("kept", yaml, {kExact});
  EXPECT_TRUE(resense_into(recording, "again", {"event_camera.seed=3"}).exact);
  EXPECT_FALSE(resense_into(recording, "again", {"event_camera.contrast_threshold=0.4"}).exact);
  EXPECT_TRUE(
      contains(notices_, "its sampling depends on the sensor, and the samples are those for a threshold of 0.2"));
  EXPECT_FALSE(contains(notices_, "too few"));
  EXPECT_FALSE(resense_into(recording, "again", {"event_camera.contrast_threshold=0.1"}).exact);
  EXPECT_TRUE(contains(notices_, "too few"));

  const fs::path rounded = simulate("rounded", yaml, {"output.samples=true"});
  const Resensed again = resense_into(rounded, "again");
  EXPECT_FALSE(again.exact);
  EXPECT_TRUE(contains(notices_, "rounded: errors of the brightness up to 0.00049"));
  const auto events = nlohmann::json::parse(content_of(rounded / "report.json"))["cameras"][0]["events"].get<double>();
  EXPECT_NEAR(static_cast<double>(again.summary.cameras[0].events()), events, 0.01 * events);
  EXPECT_LT(fs::file_size(rounded / "cam0" / "samples.esim"),
            fs::file_size(recording / "cam0" / "samples.esim") * 2 / 3);
  // The report of the new recording says so, too.
  EXPECT_TRUE(contains(content_of(folder_.path() / "again" / "report.json"), "differ slightly"));
}

TEST_F(Resense, RefusesWhatSamplesDoNotDetermine) {
  const fs::path recording = simulate("kept", "event_camera: {contrast_threshold: 0.3}\n", {"output.samples=true"});
  for (const char* option :
       {"camera.width=20", "sampling.type=flow", "duration_s=1", "truth.rate_hz=3", "renderer.image=x"})
    EXPECT_TRUE(contains(error(recording, {option}), "cannot be changed without rendering again")) << option;
  EXPECT_TRUE(
      contains(error(recording, {"event_camera.contrast_threshold=-1"}), "contrast_threshold: -1 is out of range"));
  EXPECT_TRUE(contains(error(recording, {"seed=2"}), "set event_camera.seed, the seed of the sensors"));
  EXPECT_TRUE(contains(error(folder_.path()), "is not a recording of esim simulate"));
  EXPECT_TRUE(
      contains(error(simulate("none", "")), "the recording has no samples; simulate again with output.samples=true"));
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { resense_into(recording, "kept"); }), "choose another folder"));

  const fs::path samples = recording / "cam0" / "samples.esim";
  const std::string good = content_of(samples);
  std::ofstream(samples, std::ios::binary) << good.substr(0, good.size() / 2);
  EXPECT_TRUE(contains(error(recording), "samples.esim: at byte"));
  std::string other = good;
  other[16] = 41;
  std::ofstream(samples, std::ios::binary) << other;
  EXPECT_TRUE(contains(error(recording), "has 41 x 30 px, but camera cam0 of scenario.yaml has 40 x 30 px"));
}

TEST_F(Resense, CoversSeveralCameras) {
  const std::string yaml =
      "sampling: {type: flow}\nevent_camera: {contrast_threshold: 0.2, threshold_mismatch: 0.05}\n";
  std::ofstream(folder_.path() / "rig.yaml")
      << "renderer: {type: panorama, image: p.png}\ntrajectory: {type: random, rotation_amplitude_deg: [20, 40, 30]}\n"
         "duration_s: 0.1\ncameras:\n- {name: left, width: 40, height: 30}\n- {name: frames, width: 20, height: 20, "
         "events: "
         "false, frame_camera: {}}\n- {name: right, width: 32, height: 24}\n"
      << yaml;
  const Scenario scenario = read_scenario(folder_.path() / "rig.yaml", std::vector<std::string>{kExact});
  make_recording(scenario, {.out = folder_.path() / "rig"}, quiet_, [](const Progress&) { return true; });
  EXPECT_TRUE(resense_into(folder_.path() / "rig", "again").exact);
  for (const char* camera : {"left", "right"})
    expect_same_events(folder_.path() / "again" / camera, folder_.path() / "rig" / camera);
}

}  // namespace
}  // namespace esim
