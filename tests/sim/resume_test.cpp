// Simulations that end early and are resumed, against the same simulations without interruption.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "esim/files/codecs/zstandard.h"
#include "esim/recording/recording_directory.h"
#include "esim/scenario/read.h"
#include "sim/blobs.h"
#include "sim/card_scene.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

using test::contains;

const Notices kNobodyListens{[](const std::string&) {}, [](const std::string&) {}};

/// The content of all files of a recording, except those that describe how it was made.
std::map<std::string, std::string> files_of(const fs::path& recording) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(recording)) {
    const std::string name = fs::relative(entry.path(), recording).string();
    if (!entry.is_regular_file() || name == "report.json" || name.starts_with("cam0/preview")) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files[name] = {std::istreambuf_iterator<char>(stream), {}};
  }
  return files;
}

nlohmann::json report_of(const fs::path& recording) {
  std::ifstream stream(recording / "report.json");
  return nlohmann::json::parse(stream);
}

/// Simulates until the monitor has been called so many times; 0: to the end. Returns whether the end was reached.
bool run(const Scenario& scenario, RecordingOptions options, int calls) {
  const auto summary = make_recording(scenario, std::move(options), kNobodyListens,
                                      [&, left = calls](const Progress&) mutable { return --left != 0; });
  return summary.has_value() && summary->complete;
}

struct ResumeCase {
  std::string name, yaml;
  int samples = 0;  // between interruptions
  std::vector<std::string> overrides{};
};

void PrintTo(const ResumeCase& tested, std::ostream* out) { *out << tested.name; }

/// A wall of blobs with a card before it, seen by a rig that shakes.
class ResumedSimulation : public test::CardScene, public testing::WithParamInterface<ResumeCase> {
 protected:
  ResumedSimulation() { test::write_blobs(folder_.path() / "p.png", 256); }

  Scenario read(const std::string& yaml, const std::vector<std::string>& overrides = {}) {
    folder_.write("s.yaml", yaml);
    return read_scenario(folder_.path() / "s.yaml", overrides);
  }

  static constexpr const char* kCards =
      "renderer: {type: mesh, scene: wall.obj, objects: [{name: card, scene: card.obj, flicker: {frequency_hz: "
      "100}, trajectory: {type: file, path: card.txt}}]}\n"
      "trajectory: {type: random, center: {position: [-3, 0, 0]}, rotation_amplitude_deg: [5, 5, 5]}\n"
      "start_s: 0.4\nduration_s: 0.2\noutput: {preview: false, formats: [text]}\n";
  static constexpr const char* kPlane =
      "renderer: {type: plane, image: p.png, endless: true, pose: {position: [2, 0, 0], look_at: [3, 0, 0]}}\n"
      "trajectory: {type: random, rotation_amplitude_deg: [10, 20, 15]}\n"
      "duration_s: 0.3\ncamera: {width: 48, height: 36, horizontal_fov_deg: 60}\noutput: {preview: false}\n";
};

TEST_P(ResumedSimulation, WritesTheFilesOfOneWithoutInterruption) {
  const Scenario scenario =
      read((GetParam().name.starts_with("cards") ? kCards : kPlane) + GetParam().yaml, GetParam().overrides);
  ASSERT_TRUE(run(scenario, {.out = folder_.path() / "whole", .threads = 2, .repetition = {"begin"}}, 0));
  const fs::path out = folder_.path() / "parts";
  int parts = 1;
  for (bool ended = run(scenario, {.out = out, .threads = 1, .repetition = {"begin"}}, GetParam().samples); !ended;
       ++parts) {
    ASSERT_LT(parts, 500);
    EXPECT_EQ(report_of(out)["status"], "interrupted");
    // As the command does without the scenario's file: with the scenario in the folder.
    const Scenario recorded = read_scenario(out / "scenario.yaml");
    ended = run(recorded, {.out = out, .resume = true, .threads = 1 + parts % 3, .repetition = {"resume"}},
                GetParam().samples);
  }
  EXPECT_GT(parts, 3);
  const auto whole = files_of(folder_.path() / "whole"), resumed = files_of(out);
  EXPECT_GT(whole.at("cam0/events.h5").size(), 10'000U);
  for (const auto& [name, content] : whole) {
    ASSERT_TRUE(resumed.contains(name)) << name;
    EXPECT_TRUE(content == resumed.at(name)) << name;
  }
  EXPECT_EQ(resumed.size(), whole.size());
  const nlohmann::json expected = report_of(folder_.path() / "whole"), found = report_of(out);
  for (const char* part : {"cameras", "command", "working_folder", "inputs"})
    EXPECT_EQ(expected.at(part).dump(), found.at(part).dump());
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, ResumedSimulation,
    testing::Values(
        ResumeCase{"flow", "sampling: {type: flow}\nframe_camera: {rate_hz: 40, auto_exposure: {}}\nimu: {}\n", 8},
        ResumeCase{"uniform",
                   "sampling: {type: uniform, rate_hz: 400}\nevent_camera: {surround_px: 2, surround_ms: 5}\n", 25},
        ResumeCase{"adaptive",
                   "sampling: {type: adaptive}\nframe_camera: {rate_hz: 60, line_delay_s: 0.0001}\n"
                   "event_camera: {contrast_threshold: 0.1, leak_rate_hz: 5, shot_noise_hz: 20, latency_us: 300, "
                   "latency_jitter_us: 100, refractory_period_us: 200, low_pass_hz: 200, labels: true, "
                   "readout: {rate_mev_per_s: 0.3}, filters: {trail: {}}}\n",
                   40},
        ResumeCase{
            "adaptive_circuit",
            "sampling: {type: adaptive}\nevent_camera: {preset: davis346, labels: true}\nlight: {white_lux: 500}\n"
            "frame_camera: {rate_hz: 60}\n",
            20},
        ResumeCase{"samples", "sampling: {type: flow}\n", 4, {"output.samples=exact"}},
        ResumeCase{"scanned",
                   "sampling: {type: adaptive}\nevent_camera: {preset: dvxplorer}\nlight: {white_lux: 500}\n", 10},
        ResumeCase{"keyframes",
                   "sampling: {type: keyframes, max_displacement_px: 2}\nevent_camera: {contrast_threshold: 0.1}\n", 3},
        ResumeCase{"cards_adaptive",
                   "camera: {width: 48, height: 36, horizontal_fov_deg: 40}\nsampling: {type: adaptive}\nevent_camera: "
                   "{contrast_threshold: 0.05, labels: true}\n"
                   "truth: {rate_hz: 100, optical_flow: true, objects: true, event_points: true, pose_rate_hz: 300}\n"
                   "frame_camera: {rate_hz: 50}\n",
                   40},
        ResumeCase{
            "cards_sensors",
            "sampling: {type: flow}\n"
            "cameras: [{name: cam0, width: 48, height: 36, horizontal_fov_deg: 40, event_camera: {contrast_threshold: "
            "0.05}}, {name: cam1, width: 40, height: 30, event_cameras: [{name: a}, {name: b, preset: davis346}]}]\n",
            12},
        ResumeCase{"cards_keyframes",
                   "camera: {width: 48, height: 36, horizontal_fov_deg: 40}\nsampling: {type: keyframes, "
                   "max_displacement_px: 3}\nevent_camera: {contrast_threshold: 0.05}\n",
                   2}),
    [](const auto& tested) { return tested.param.name; });

class Resume : public ResumedSimulation {
 protected:
  std::string error(const Scenario& scenario) {
    return test::message_of<UserError>([&] { run(scenario, {.out = folder_.path() / "out", .resume = true}, 0); });
  }
};

TEST_F(Resume, SaysWhyItCannotContinue) {
  const Scenario scenario = read(kPlane);
  EXPECT_TRUE(contains(error(scenario), "there is neither")) << error(scenario);
  run(scenario, {.out = folder_.path() / "out"}, 30);
  EXPECT_TRUE(contains(error(read(kPlane, {"duration_s=0.4"})), "\"duration_s: 0.3\", now \"duration_s: 0.4\""))
      << error(read(kPlane, {"duration_s=0.4"}));
  {
    std::ofstream(folder_.path() / "p.png", std::ios::app) << " ";
    EXPECT_TRUE(contains(error(scenario), "p.png has been changed since")) << error(scenario);
    test::write_blobs(folder_.path() / "p.png", 256);
  }
  EXPECT_TRUE(fs::exists(folder_.path() / "out.incomplete/cam0/events.h5"));  // nothing has been removed
  const fs::path checkpoint = folder_.path() / "out.incomplete/checkpoint";
  fs::resize_file(checkpoint / "journal", fs::file_size(checkpoint / "journal") / 2);
  EXPECT_TRUE(contains(error(scenario), "p.png has been changed since"));
}

TEST_F(Resume, RefusesDamagedCheckpointsAndThoseOfOtherBuilds) {
  const Scenario scenario = read(kPlane);
  run(scenario, {.out = folder_.path() / "out"}, 30);
  const fs::path checkpoint = folder_.path() / "out/checkpoint";
  const auto content = [](const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(stream), {}};
  };
  const std::string state = content(checkpoint / "state"), journal = content(checkpoint / "journal");
  const auto with_state = [&](std::string changed) {
    std::ofstream(checkpoint / "state", std::ios::binary) << changed;
    return error(scenario);
  };
  constexpr std::size_t kSignature = 16;
  std::string bytes(zstandard_content_size(state.substr(kSignature)), '\0'), frame;
  ASSERT_TRUE(decompress_zstandard(state.substr(kSignature), bytes));
  bytes[bytes.find("0.1.0")] = '9';
  compress_zstandard(bytes, 1, frame);
  EXPECT_TRUE(contains(with_state(state.substr(0, kSignature) + frame), "another build of esim, 9.1.0"));
  EXPECT_TRUE(contains(with_state(state.substr(0, state.size() / 2)), "state is damaged"));
  std::string changed = state;
  changed[state.size() / 2] ^= 1;
  EXPECT_TRUE(contains(with_state(changed), "state is damaged"));
  EXPECT_TRUE(contains(with_state("something else"), "is not a checkpoint"));
  EXPECT_TRUE(contains(with_state(""), "is not a checkpoint"));
  std::ofstream(checkpoint / "state", std::ios::binary) << state;
  fs::resize_file(checkpoint / "journal", journal.size() / 2);
  EXPECT_TRUE(contains(error(scenario), "journal is damaged"));
}

TEST_F(Resume, HasNoCheckpointWhereNoneIsWritten) {
  const Scenario scenario = read(kPlane, {"output.checkpoints=false"});
  run(scenario, {.out = folder_.path() / "out", .replace = true}, 30);
  EXPECT_FALSE(fs::exists(folder_.path() / "out/checkpoint"));
  EXPECT_TRUE(contains(error(scenario), "has no checkpoint")) << error(scenario);
}

/// Fails as on a full disk.
class FullDisk final : public Sink {
 public:
  void begin(const RecordingInfo&) override {}
  void write(const Record& record) override {
    if (std::holds_alternative<PoseRecord>(record) && ++poses_ == 20) throw OutputError("no space left on device");
  }
  void end(bool) override {}

 private:
  int poses_ = 0;
};

TEST_F(Resume, ContinuesWhereTheDiskWasFull) {
  const Scenario scenario = read(std::string(kPlane) + "truth: {pose_rate_hz: 100}\n");
  run(scenario, {.out = folder_.path() / "whole"}, 0);
  const fs::path out = folder_.path() / "out";
  run(scenario, {.out = out}, 4);
  const std::string said = test::message_of<OutputError>(
      [&] { run(scenario, {.out = out, .resume = true, .beside = std::make_unique<FullDisk>()}, 0); });
  EXPECT_TRUE(contains(said, "no space left")) << said;
  EXPECT_FALSE(fs::exists(out));
  EXPECT_TRUE(run(scenario, {.out = out, .resume = true}, 0));
  EXPECT_TRUE(files_of(out) == files_of(folder_.path() / "whole"));
}

TEST_F(Resume, ReplacesTheRecordingThatTheKilledSimulationWasToReplace) {
  const Scenario scenario = read(kPlane);
  const fs::path out = folder_.path() / "out", incomplete = folder_.path() / "out.incomplete";
  run(scenario, {.out = out}, 30);
  fs::rename(out, incomplete);
  fs::create_directory(out);
  folder_.write("out/report.json", "{}");
  EXPECT_TRUE(run(scenario, {.out = out, .resume = true}, 0));
  EXPECT_FALSE(fs::exists(incomplete));
  EXPECT_EQ(report_of(out)["status"], "complete");
}

TEST_F(Resume, LeavesNoCheckpointInACompleteRecording) {
  run(read(kPlane), {.out = folder_.path() / "out"}, 0);
  EXPECT_FALSE(fs::exists(folder_.path() / "out/checkpoint"));
  EXPECT_TRUE(contains(error(read(kPlane)), "is complete")) << error(read(kPlane));
}

}  // namespace
}  // namespace esim
