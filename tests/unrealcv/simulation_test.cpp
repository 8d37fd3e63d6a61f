// From a scenario to a recording.
#include "esim/compose/compose.h"
#include "esim/formats/inspect.h"
#include "esim/recording/recording_directory.h"
#include "esim/scenario/read.h"
#include "support/temporary_directory.h"
#include "unrealcv/shown.h"

namespace esim {
namespace {

using test::UnrealcvServer;

class CountingSink final : public Sink {
 public:
  void begin(const RecordingInfo& recording) override { info = recording; }
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record)) events += part->events.size();
  }
  void end(bool is_complete) override { complete = is_complete; }

  RecordingInfo info;
  std::size_t events = 0;
  bool complete = false;
};

class UnrealcvSimulation : public testing::Test {
 protected:
  Scenario scenario(const std::string& more) const {
    ScenarioText text;
    text.yaml = "renderer: {type: unrealcv, port: " + std::to_string(server_->port()) + ", timeout_s: " + timeout_ +
                objects_ +
                "}\n"
                "trajectory: {type: random, position_amplitude_m: [0.2, 0.2, 0.1], rotation_amplitude_deg: [4, 4, 4]}\n"
                "duration_s: 0.2\nseed: 3\nevent_camera: {contrast_threshold: 0.15}\n" +
                more;
    text.file = "test.yaml";
    return read_scenario(text);
  }
  void serve(const std::string& scene, std::vector<std::string> objects = {}) {
    server_.emplace(test::show_with([=](const Camera& model) { return test::make_renderer(scene, model); }, objects),
                    objects);
  }
  static World build(const Scenario& scenario) {
    return build_world(scenario, 2, {[](const std::string&) {}, [](const std::string&) {}});
  }
  static Summary run(const Scenario& scenario, Sink& out) {
    World world = build(scenario);
    return simulate(world, out, [](const Progress&) { return true; });
  }

  std::optional<UnrealcvServer> server_;
  std::string timeout_ = "60", objects_;
};

/// Light that moves as the camera does.
PinholeImage show_wave(const test::ServedView& view) {
  PinholeImage image{Image<float>(view.width, view.height), Image<float>(view.width, view.height, 2.0F), {}};
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x)
      image.irradiance(x, y) = static_cast<float>(0.5 + 0.4 * std::sin(0.3 * x + 0.2 * view.camera.location_cm.y()));
  }
  return image;
}

constexpr const char* kSmall = "camera: {width: 80, height: 60}\n";

TEST_F(UnrealcvSimulation, KeyframesAreTheDefaultAndAgreeWithDenseSampling) {
  serve("mesh");
  const Scenario sparse = scenario(kSmall);
  EXPECT_TRUE(std::holds_alternative<KeyframeSampling>(sparse.cameras[0].sampling));
  CountingSink few, many;
  const Summary few_images = run(sparse, few);
  const Summary many_images = run(scenario(std::string(kSmall) + "sampling: {type: uniform, rate_hz: 1000}\n"), many);
  EXPECT_TRUE(few_images.complete && many_images.complete);
  EXPECT_LT(4 * few_images.cameras[0].sampling.samples, many_images.cameras[0].sampling.samples);
  ASSERT_GT(many.events, 2000U);
  EXPECT_NEAR(static_cast<double>(few.events) / static_cast<double>(many.events), 1, 0.05);
  EXPECT_TRUE(test::contains(few_images.cameras[0].renderer, "unrealcv on 127.0.0.1:"));
  const std::vector<std::string> commands = server_->commands();
  EXPECT_TRUE(test::has_command(commands, "vrun r.setres 80x60"));
  EXPECT_TRUE(test::has_command(commands, "vrun r.setres 192x152")) << "2 (80 + 16) x 2 (60 + 16)";
}

TEST_F(UnrealcvSimulation, EveryCameraOfARigHasAPoseOfItsOwn) {
  serve("mesh");
  CountingSink out;
  const Summary summary =
      run(scenario("sampling: {type: uniform, rate_hz: 100}\ncameras:\n- {name: left, width: 40, height: 30}\n"
                   "- {name: right, width: 48, height: 30, T_body_camera: {position: [0.1, 0, 0]}}\n"),
          out);
  EXPECT_TRUE(summary.complete);
  const std::vector<std::string> commands = server_->commands();
  EXPECT_TRUE(test::has_command(commands, "vrun r.setres 40x30") && test::has_command(commands, "vrun r.setres 48x30"));
  std::set<std::string> poses;
  for (const std::string& command : commands)
    if (command.starts_with("vset /camera/0/pose")) poses.insert(command);
  EXPECT_GE(poses.size(), 40U) << "21 samples of each camera";
  EXPECT_EQ(server_->connections(), 1);
}

TEST_F(UnrealcvSimulation, ObjectsAreMovedAndSeen) {
  serve("moving_mesh", {"left", "right"});
  objects_ =
      ", objects: [{name: left, trajectory: {type: random, position_amplitude_m: [0, 0.2, 0.2], center: {position: "
      "[1.7, 0.4, 0.1], quaternion: [0, 0, 0, 1]}}}, {name: right, trajectory: {type: static, pose: {position: [2.4, "
      "-0.7, -0.2]}}}]";
  CountingSink out;
  EXPECT_TRUE(run(scenario(std::string(kSmall) + "sampling: {type: uniform, rate_hz: 50}\n"), out).complete);
  EXPECT_EQ(out.info.objects, (std::vector<std::string>{"left", "right"}));
  std::set<std::string> places;
  for (const std::string& command : server_->commands())
    if (command.starts_with("vset /object/left/location")) places.insert(command);
  EXPECT_GT(places.size(), 4U);
  EXPECT_TRUE(test::has_command(server_->commands(), "vset /object/right/location 240.000000 70.000000 -20.000000"));
}

TEST_F(UnrealcvSimulation, WhatWasSimulatedBeforeTheServerDiedIsKept) {
  server_.emplace(show_wave);
  timeout_ = "1";
  const test::TemporaryDirectory folder;
  const Scenario dense = scenario(std::string(kSmall) + "sampling: {type: uniform, rate_hz: 500}\n");
  World world = build(dense);
  RecordingDirectory directory(folder.path() / "out", false);
  const auto sink = build_sink(dense, directory.path());
  const Summary summary = simulate(world, *sink, [&](const Progress& progress) {
    if (progress.now >= 100 * kNsPerMs) server_->stop();
    return true;
  });
  EXPECT_FALSE(summary.complete);
  EXPECT_TRUE(
      test::contains(summary.problem, "127.0.0.1:" + std::to_string(server_->port()) + ": the connection was lost"));
  EXPECT_GE(summary.end, 100 * kNsPerMs);
  EXPECT_LT(summary.end, 110 * kNsPerMs);
  directory.finish(report_json(dense, summary, 2, {}));

  const Inspection found = inspect(folder.path() / "out");
  EXPECT_EQ(found.status, RecordingStatus::interrupted);
  EXPECT_TRUE(test::contains(found.reason, "the connection was lost"));
  ASSERT_EQ(found.cameras.size(), 1U);
  EXPECT_TRUE(found.cameras[0].problem.empty()) << found.cameras[0].problem;
  EXPECT_GT(found.cameras[0].events, 500U);
  EXPECT_LT(found.cameras[0].last, 110 * kNsPerMs);
}

TEST_F(UnrealcvSimulation, RefusesWhatItCannotDo) {
  serve("mesh");
  const auto refusal = [&](const std::string& more) {
    const Scenario wanted = scenario(more);
    return test::message_of<UserError>([&] { build(wanted); });
  };
  EXPECT_TRUE(test::contains(refusal("camera: {width: 32, height: 24, colour: rggb}\nsampling: {type: flow}\n"),
                             "unrealcv renders luminance only"));
  EXPECT_TRUE(
      test::contains(refusal("camera: {width: 32, height: 24}\nsampling: {type: flow}\ntruth: {event_points: true}\n"),
                     "truth.event_points"));
  server_->stop();
  EXPECT_TRUE(test::contains(refusal(kSmall), "cannot connect: "));
}

}  // namespace
}  // namespace esim
