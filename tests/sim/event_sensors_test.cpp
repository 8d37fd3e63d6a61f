// Several event sensors behind one lens, against simulations with each of them alone.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "esim/compose/compose.h"
#include "esim/formats/formats.h"
#include "esim/sim/simulate.h"
#include "sim/blobs.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// Keeps the events, their labels and points, by camera of the recording.
class SensorStreams final : public Sink {
 public:
  struct Stream {
    std::vector<Event> events;
    std::vector<EventLabel> labels;
    std::vector<float> points;
    bool operator==(const Stream&) const = default;
  };

  void begin(const RecordingInfo& recording) override {
    info = recording;
    streams.resize(recording.cameras.size());
  }
  void write(const Record& record) override {
    if (const auto* part = std::get_if<EventsRecord>(&record)) {
      Stream& stream = streams[static_cast<std::size_t>(part->camera)];
      stream.events.insert(stream.events.end(), part->events.begin(), part->events.end());
      stream.labels.insert(stream.labels.end(), part->labels.begin(), part->labels.end());
    }
    if (const auto* part = std::get_if<EventPointsRecord>(&record)) {
      for (const Eigen::Vector3f& point : part->points)
        streams[static_cast<std::size_t>(part->camera)].points.insert(
            streams[static_cast<std::size_t>(part->camera)].points.end(), {point.x(), point.y(), point.z()});
    }
    truth += std::holds_alternative<TruthRecord>(record);
    frames += std::holds_alternative<FrameRecord>(record);
  }
  void end(bool) override {}

  RecordingInfo info;
  std::vector<Stream> streams;
  int truth = 0, frames = 0;
};

SensorOptions named(const std::string& name, const EventCameraOptions& options) {
  SensorOptions sensor{options};
  sensor.name = name;
  return sensor;
}

/// Sensors of all kinds.
std::vector<SensorOptions> all_kinds() {
  EventCameraOptions noisy = preset_options("davis346@1");
  noisy.contrast_threshold_on = 0.12;
  noisy.labels = true;
  EventCameraOptions circuit = preset_options("davis346");
  circuit.contrast_threshold_on = circuit.contrast_threshold_off = 0.15;
  circuit.circuit->white_lux = 20;
  EventCameraOptions slow{.contrast_threshold = 0.2};
  slow.readout.rate_mev_per_s = 0.5;
  EventCameraOptions filtered{.contrast_threshold = 0.1, .labels = true};
  filtered.filters.trail = TrailFilterOptions{};
  std::vector<SensorOptions> sensors = {named("ideal", {.contrast_threshold = 0.3}),
                                        named("low", {.contrast_threshold = 0.05, .threshold_mismatch = 0.03}),
                                        named("noisy", noisy),
                                        named("circuit", circuit),
                                        named("slow", slow),
                                        named("filtered", filtered)};
  sensors.push_back(sensors[1]);
  sensors.back().name = "low2";
  sensors.back().seed = 77;
  return sensors;
}

class EventSensors : public testing::Test {
 protected:
  void SetUp() override {
    test::write_blobs(folder_.path() / "p.png", 256);
    RandomTrajectoryOptions motion;
    motion.rotation_amplitude_deg = {20, 40, 30};
    scenario_.trajectory = motion;
    scenario_.renderer = PanoramaRendererOptions{folder_.path() / "p.png", {0, 0, 0, 1}};
    scenario_.duration_s = 0.15;
    scenario_.seed = 5;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = 40, camera.height = 30;
    camera.sampling = FlowSampling{};
    scenario_.cameras = {camera};
  }

  std::pair<SensorStreams, Summary> run(int threads = 2) {
    World world = build_world(scenario_, threads, {[](const std::string&) {}, [](const std::string&) {}});
    SensorStreams out;
    Summary summary = simulate(world, out, [](const Progress&) { return true; });
    return {std::move(out), std::move(summary)};
  }

  /// Compares each sensor of the first camera with the same sensor alone.
  void expect_as_alone() {
    const SensorStreams together = run().first;
    for (const int threads : {1, 3, 16}) EXPECT_EQ(run(threads).first.streams, together.streams) << threads;
    const std::vector<SensorOptions> sensors = scenario_.cameras[0].event_cameras;
    ASSERT_EQ(together.info.cameras.size(), 1 + sensors.size());
    EXPECT_TRUE(together.streams[0].events.empty());
    for (std::size_t k = 0; k < sensors.size(); ++k) {
      SCOPED_TRACE(sensors[k].name);
      const CameraInfo& info = together.info.cameras[1 + k];
      EXPECT_EQ(info.name, "cam0/" + sensors[k].name);
      EXPECT_EQ(info.lens, 0);
      EXPECT_EQ(info.model.width, 40);
      EXPECT_EQ(info.has_labels, sensors[k].labels);
      scenario_.cameras[0].event_cameras.clear();
      scenario_.cameras[0].event_camera = sensors[k];
      scenario_.cameras[0].event_camera.name.clear();
      const SensorStreams alone = run().first;
      EXPECT_GT(alone.streams[0].events.size(), 100U);
      EXPECT_EQ(together.streams[1 + k], alone.streams[0]);
      EXPECT_EQ(together.truth, alone.truth);
      EXPECT_EQ(together.frames, alone.frames);
    }
  }

  test::TemporaryDirectory folder_;
  Scenario scenario_;
};

TEST_F(EventSensors, SeeWhatEachWouldSeeAloneWithFlowSampling) {
  scenario_.cameras[0].event_cameras = all_kinds();
  scenario_.cameras[0].frame_camera = FrameCameraOptions{};
  expect_as_alone();
}

TEST_F(EventSensors, SeeWhatEachWouldSeeAloneAtAFixedRate) {
  scenario_.cameras[0].event_cameras = all_kinds();
  scenario_.cameras[0].sampling = UniformSampling{500};
  expect_as_alone();
}

TEST_F(EventSensors, EachHaveTheSceneOfTheirLabelsWhereLightsFlickerAndSpritesMove) {
  SpritesRendererOptions sprites;
  SpriteOptions background, moving;
  background.image = moving.image = folder_.path() / "p.png";
  moving.poses = {{.t_s = 0, .position = {-15, 0}, .scale = {0.1, 0.1}},
                  {.t_s = 0.15, .position = {15, 0}, .scale = {0.1, 0.1}}};
  moving.flicker = FlickerOptions{};
  moving.flicker->frequency_hz = 100;
  sprites.sprites = {moving, background};  // the first is in front
  scenario_.renderer = sprites;
  scenario_.trajectory = StaticTrajectoryOptions{};
  std::vector<SensorOptions> sensors = all_kinds();
  for (SensorOptions& sensor : sensors) {
    // Segments of flickering light are divided for the strictest sensor of a camera; all have the same threshold.
    sensor.contrast_threshold = 0.1, sensor.log_eps = 1e-3;
    sensor.contrast_threshold_on.reset(), sensor.contrast_threshold_off.reset();
    sensor.labels = true;
  }
  std::erase_if(sensors, [](const SensorOptions& sensor) { return sensor.circuit.has_value(); });  // another dark light
  scenario_.cameras[0].event_cameras = sensors;
  expect_as_alone();
  const SensorStreams together = run().first;
  EXPECT_TRUE(std::ranges::any_of(together.streams.back().labels, [](const EventLabel& l) { return l.object == 1; }));
  EXPECT_TRUE(std::ranges::any_of(together.streams.back().labels, [](const EventLabel& l) { return l.flicker != 0; }));
}

TEST_F(EventSensors, AreCountedByCameraAndSensor) {
  scenario_.cameras.push_back(scenario_.cameras[0]);
  scenario_.cameras[1].name = "right";
  scenario_.cameras[0].event_cameras = {named("a", {.contrast_threshold = 0.1}),
                                        named("b", {.contrast_threshold = 0.2})};
  scenario_.cameras[0].event_cameras[1].seed = 12;
  scenario_.cameras[0].event_cameras[1].varied = {{"contrast_threshold", "0.2"}};
  scenario_.cameras[1].event_cameras = {named("a", {.contrast_threshold = 0.3})};
  const auto [out, summary] = run();
  std::vector<std::string> names;
  for (const CameraInfo& camera : out.info.cameras) names.push_back(camera.name);
  EXPECT_EQ(names, (std::vector<std::string>{"cam0", "right", "cam0/a", "cam0/b", "right/a"}));
  EXPECT_EQ(out.info.cameras[4].lens, 1);
  ASSERT_EQ(summary.cameras.size(), 2U);
  const auto count = [&](std::size_t camera) { return static_cast<std::int64_t>(out.streams[camera].events.size()); };
  EXPECT_EQ(summary.cameras[0].sensors[1].events_on + summary.cameras[0].sensors[1].events_off, count(3));
  EXPECT_EQ(summary.cameras[0].events(), count(2) + count(3));
  EXPECT_EQ(summary.cameras[1].events(), count(4));
  EXPECT_GT(count(2), count(3));

  const auto report = nlohmann::json::parse(report_json(scenario_, summary, 1, {}));
  const auto& camera = report["cameras"][0];
  EXPECT_EQ(camera["events"], count(2) + count(3));
  ASSERT_EQ(camera["sensors"].size(), 2U);
  EXPECT_EQ(camera["sensors"][0]["name"], "a");
  EXPECT_EQ(camera["sensors"][0]["seed"], 5);
  EXPECT_EQ(camera["sensors"][1]["folder"], "cam0/b");
  EXPECT_EQ(camera["sensors"][1]["seed"], 12);
  EXPECT_EQ(camera["sensors"][1]["contrast_threshold_on"], 0.2);
  EXPECT_EQ(camera["sensors"][1]["varied"]["contrast_threshold"], "0.2");
  EXPECT_EQ(camera["sensors"][1]["events"], count(3));
}

TEST_F(EventSensors, DecideTheSamplingByTheStrictestOfThem) {
  scenario_.cameras[0].sampling = AdaptiveSampling{};
  const auto evaluations = [&](const std::vector<SensorOptions>& sensors) {
    scenario_.cameras[0].event_cameras = sensors;
    return run().second.cameras[0].sampling.pixel_evaluations;
  };
  const SensorOptions low = named("low", {.contrast_threshold = 0.05}),
                      high = named("high", {.contrast_threshold = 0.5});
  const auto strict = evaluations({low});
  EXPECT_GT(strict, evaluations({high}));
  EXPECT_EQ(strict, evaluations({high, low}));
  EXPECT_EQ(strict, evaluations({low, high}));
}

TEST_F(EventSensors, WriteFilesIntoFoldersOfTheirNames) {
  scenario_.cameras[0].event_cameras = {named("a", {.contrast_threshold = 0.1}),
                                        named("b", {.contrast_threshold = 0.2})};
  scenario_.output.formats = {"text", "rosbag"};
  const auto quiet = [](const std::string&) {};
  make_recording(scenario_, {folder_.path() / "out"}, {quiet, quiet}, [](const Progress&) { return true; });
  const auto out = folder_.path() / "out";
  for (const char* file : {"cam0/a/events.h5", "cam0/b/events.h5", "cam0/a/events.txt", "cam0/truth.h5",
                           "cam0/preview.png", "recording.bag", "calibration/rig.yaml"})
    EXPECT_TRUE(std::filesystem::exists(out / file)) << file;
  for (const char* file : {"cam0/events.h5", "cam0/events.txt", "cam0/a/truth.h5"})
    EXPECT_FALSE(std::filesystem::exists(out / file)) << file;

  const SensorStreams simulated = run().first;
  for (const auto& path : {out, out / "recording.bag"}) {
    SCOPED_TRACE(path);
    const auto source = open_source(path);
    ASSERT_EQ(source->info().cameras.size(), 3U);
    std::map<std::string, std::size_t> events;
    while (const Record* const record = source->next()) {
      if (const auto* part = std::get_if<EventsRecord>(record))
        events[source->info().cameras[static_cast<std::size_t>(part->camera)].name] += part->events.size();
    }
    EXPECT_EQ(events["cam0/a"] + events["cam0_a"], simulated.streams[1].events.size());
    EXPECT_EQ(events["cam0/b"] + events["cam0_b"], simulated.streams[2].events.size());
  }
  const auto one = open_source(out / "cam0" / "b");
  ASSERT_EQ(one->info().cameras.size(), 1U);
  EXPECT_EQ(one->info().cameras[0].name, "cam0/b");
  EXPECT_EQ(one->info().cameras[0].model.fx, simulated.info.cameras[0].model.fx);
  EXPECT_EQ(open_source(out / "cam0")->info().cameras.size(), 3U);
}

}  // namespace
}  // namespace esim
