#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "esim/compose/compose.h"
#include "esim/compose/samples/samples_file.h"
#include "esim/compose/samples/stored_samples.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/motion/static.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"
#include "esim/scenario/read.h"

namespace esim::inline compose {
namespace {

namespace fs = std::filesystem;

/// The scenario of a recording, with overrides.
Scenario recorded_scenario(const fs::path& recording, std::vector<std::string> overrides, const std::string& setter) {
  const fs::path file = recording / "scenario.yaml";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw UserError(
        fmt::format("{}: is not a recording of esim simulate: it has no scenario.yaml", recording.string()));
  }
  ScenarioText text;
  text.overrides = std::move(overrides);
  text.setter = setter;
  text.needs_renderer = text.needs_trajectory = text.needs_waypoints = false;
  return read_scenario(file, text);
}

bool is_or_is_in(const std::string& key, const std::string& option) {
  return key == option || key.starts_with(option + ".");
}

/// An event sensor in the written form of a scenario.
struct WrittenSensor {
  std::string key;   // dotted
  std::string name;  // empty: the only one of its camera
};

std::vector<WrittenSensor> written_sensors(const Scenario& recorded) {
  std::vector<WrittenSensor> sensors;
  for (std::size_t i = 0; i < recorded.cameras.size(); ++i) {
    const CameraOptions& camera = recorded.cameras[i];
    if (!camera.events) continue;
    if (camera.event_cameras.empty()) sensors.push_back({fmt::format("cameras.{}.event_camera", i), ""});
    for (std::size_t k = 0; k < camera.event_cameras.size(); ++k)
      sensors.push_back({fmt::format("cameras.{}.event_cameras.{}", i, k), camera.event_cameras[k].name});
  }
  return sensors;
}

/// Overrides for the written form of a scenario, in which every sensor states all its options. `event_camera` as a
/// whole and `event_cameras` replace the sensors of each camera. Single options apply to each sensor, and a preset,
/// which gives the defaults of the others, replaces them all.
void add_override(const Scenario& recorded, const std::string& key, const std::string& value, const std::string& setter,
                  std::vector<std::string>& result) {
  if (key == "light.white_lux" || is_or_is_in(key, "output")) {
    result.push_back(key + "=" + value);
  } else if (key == "event_camera" || is_or_is_in(key, "event_cameras")) {
    for (std::size_t i = 0; i < recorded.cameras.size(); ++i) {
      if (key == "event_camera") result.push_back(fmt::format("cameras.{}.event_cameras=null", i));
      result.push_back(fmt::format("cameras.{}.{}={}", i, key, value));
    }
  } else if (key == "event_camera.preset") {
    for (const auto& [sensor, name] : written_sensors(recorded)) {
      const std::string named = name.empty() ? "" : fmt::format("name: {}, ", name);
      result.push_back(fmt::format("{}={{{}preset: {}}}", sensor, named, value));
    }
  } else if (is_or_is_in(key, "event_camera")) {
    const std::string option = key.substr(key.find('.'));
    for (const auto& [sensor, name] : written_sensors(recorded)) result.push_back(sensor + option + "=" + value);
  } else {
    throw UserError(fmt::format(
        "{}{}: cannot be changed without rendering again; resense changes event_camera, event_cameras, light.white_lux "
        "and output only{}",
        setter, key, key == "seed" ? ": set event_camera.seed, the seed of the sensors" : ": simulate again"));
  }
}

/// Why the events are not those of a simulation with the new sensors; empty if they are.
std::string inexact_because(const Scenario& recorded, const Scenario& changed,
                            const std::vector<SampleStoreInfo>& stores) {
  for (const SampleStoreInfo& store : stores) {
    if (store.precision == SamplePrecision::rounded)
      return fmt::format("the samples are rounded: errors of the brightness up to {:.2g}", kMaxRoundingError);
  }
  for (std::size_t i = 0; i < recorded.cameras.size(); ++i) {
    if (!changed.cameras[i].events) continue;
    const bool by_sensor = sampling_depends_on_sensors(recorded.cameras[i]);
    const SensorTraits then = strictest_sensor(recorded, recorded.cameras[i]),
                       now = strictest_sensor(changed, changed.cameras[i]);
    const bool same = then.contrast_threshold == now.contrast_threshold && then.log_eps == now.log_eps;
    if (same || !(by_sensor || flickers(recorded))) continue;
    const std::string what =
        by_sensor ? "its sampling depends on the sensor" : "its flickering light is divided as the sensor requires";
    const bool stricter = now.contrast_threshold < then.contrast_threshold || now.log_eps < then.log_eps;
    return fmt::format(
        "camera {}: {}, and the samples are those for a threshold of {:.4g}{}", recorded.cameras[i].name, what,
        then.contrast_threshold,
        stricter ? ": for the new sensor they are too few. Simulate again, or simulate with the smallest threshold"
                 : "");
  }
  return {};
}

/// What remains of a scenario without its scene: the sensors. The segments contain light, colour filters and motion.
Scenario sensors_only(const Scenario& changed) {
  Scenario sensors = changed;
  sensors.start_s = 0;
  sensors.duration_s.reset();
  sensors.renderer = PanoramaRendererOptions{};
  sensors.light.flicker.reset();
  sensors.imu.reset();
  sensors.truth.rate_hz = sensors.truth.pose_rate_hz = 0;
  sensors.truth.objects = sensors.truth.optical_flow = sensors.truth.event_points = false;
  sensors.output.samples = KeptSamples::none;
  for (CameraOptions& camera : sensors.cameras) {
    camera.sampling = FlowSampling{};
    camera.colour = ColourFilters::none;
    camera.frame_camera.reset();
  }
  return sensors;
}

/// The stores of the cameras with sensors, checked against the scenario.
std::vector<SampleStoreReader> open_stores(const Scenario& scenario, const fs::path& recording, bool read_ahead) {
  std::vector<SampleStoreReader> stores;
  for (const CameraOptions& camera : scenario.cameras) {
    if (!camera.events) continue;
    const fs::path file = recording / camera.name / kSamplesFile;
    std::error_code error;
    if (!fs::is_regular_file(file, error)) {
      throw UserError(fmt::format(
          "{}: does not exist: the recording has no samples; simulate again with output.samples=true", file.string()));
    }
    const SampleStoreInfo& info = stores.emplace_back(file, read_ahead).info();
    if (info.width != camera.width || info.height != camera.height) {
      throw UserError(fmt::format("{}: has {} x {} px, but camera {} of scenario.yaml has {} x {} px; simulate again",
                                  file.string(), info.width, info.height, camera.name, camera.width, camera.height));
    }
    if (info.start != stores.front().info().start || info.end != stores.front().info().end) {
      throw UserError(fmt::format("{}: covers another time than that of camera {}; simulate again", file.string(),
                                  scenario.cameras.front().name));
    }
  }
  if (stores.empty()) throw UserError(fmt::format("{}: no camera has an event sensor", recording.string()));
  return stores;
}

/// The threads for the pixels. Pixels of a single sensor without a circuit are so fast that reading the samples and
/// writing the events keep another thread busy.
int pixel_threads(const Scenario& scenario, int threads) {
  std::size_t sensors = 0;
  bool circuit = false;
  for (const CameraOptions& camera : scenario.cameras) {
    for (const SensorOptions& sensor : camera.sensors()) ++sensors, circuit |= sensor.circuit.has_value();
  }
  return sensors == 1 && !circuit ? std::max(1, threads - 1) : threads;
}

/// Refuses labels that need what the samples do not contain.
void check_labels(const Scenario& recorded, const Scenario& changed, const fs::path& recording) {
  const bool labels = std::ranges::any_of(changed.cameras, [](const CameraOptions& camera) {
    return std::ranges::any_of(camera.sensors(), &SensorOptions::labels);
  });
  if (!labels) return;
  std::error_code error;
  const bool moves =
      fs::exists(recording / "objects", error) || std::holds_alternative<SpritesRendererOptions>(recorded.renderer);
  if (moves || flickers(recorded)) {
    throw UserError(
        "event_camera.labels: the samples contain neither the objects that the pixels saw nor the flicker of the "
        "light; "
        "remove it, or simulate again");
  }
}

}  // namespace

Resensed resense(const ResenseOptions& options, const Notices& notify, const Monitor& monitor) {
  std::vector<std::string> given;
  const Notices notices = keeping(notify, given);
  const Scenario recorded = recorded_scenario(options.recording, {}, options.setter);
  std::vector<std::string> overrides;
  for (const std::string& text : options.overrides) {
    const std::size_t equals = std::min(text.find('='), text.size());
    add_override(recorded, text.substr(0, equals), text.substr(std::min(equals + 1, text.size())), options.setter,
                 overrides);
  }
  const Scenario changed = recorded_scenario(options.recording, overrides, options.setter);
  const int threads = Workers(options.threads).threads();
  std::vector<SampleStoreReader> stores = open_stores(changed, options.recording, threads > 1);
  check_labels(recorded, changed, options.recording);
  std::error_code error;
  if (fs::equivalent(options.recording, options.out, error))
    throw UserError(fmt::format("{}: is the recording with the samples; choose another folder", options.out.string()));
  RecordingDirectory directory(options.out, options.replace);
  ProvenanceRecorder provenance(options.repetition);
  provenance.add(changed.files);

  std::vector<SampleStoreInfo> infos;
  for (const SampleStoreReader& store : stores) infos.push_back(store.info());
  notices.note(fmt::format("events of the samples in {}", options.recording.string()));
  Resensed result;
  const std::string reason = inexact_because(recorded, changed, infos);
  result.exact = reason.empty();
  (result.exact ? notices.note : notices.warning)(
      result.exact
          ? "the events are exactly those of a simulation with these sensors"
          : fmt::format("the events differ slightly from those of a simulation with these sensors: {}", reason));

  const Scenario sensors = sensors_only(changed);
  Substitutes substitutes;
  substitutes.body =
      std::make_shared<const StaticTrajectory>(SE3{}, infos.front().start, infos.front().end - infos.front().start);
  substitutes.make_renderer = [](const Camera&, const Workers&) { return make_no_renderer(); };
  World world = build_world(sensors, substitutes, pixel_threads(sensors, threads), notices);
  auto store = stores.begin();
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    world.cameras[i].sampler = sensors.cameras[i].events ? make_stored_sampler(std::move(*store++), *world.workers)
                                                         : make_no_sampler(world.info.end);
  }
  write_file_atomically(directory.path() / "scenario.yaml", write_scenario(changed));
  const std::unique_ptr<Sink> sink = build_sink(sensors, directory.path());
  bool anything = false;
  keep_on_failure(directory, anything, [&]() -> std::optional<Summary> {
    result.summary = simulate(world, *sink, [&](const Progress& progress) {
      anything |= progress.now > progress.start;
      return monitor(progress);
    });
    for (const std::string& loss : losses(sensors, result.summary)) given.push_back("warning: " + loss);
    directory.finish(report_json(changed, result.summary, threads, given, provenance.finish(result.summary.complete)));
    return result.summary;
  });
  return result;
}

}  // namespace esim::inline compose
