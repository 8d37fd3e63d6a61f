#include "esim/compose/samples/changed_sensors.h"

#include <fmt/format.h>

#include <algorithm>

#include "esim/compose/compose.h"
#include "esim/compose/samples/samples_file.h"
#include "esim/compose/samples/stored_samples.h"
#include "esim/core/error.h"
#include "esim/core/remedy.h"
#include "esim/motion/static.h"
#include "esim/scenario/read.h"

namespace esim::inline compose {
namespace {

namespace fs = std::filesystem;

/// The scenario of a recording, with overrides.
Scenario recorded_scenario(const fs::path& recording, std::vector<std::string> overrides, const std::string& setter,
                           const std::function<std::string(const fs::path&)>& refuses) {
  const fs::path file = recording / "scenario.yaml";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw UserError(
        fmt::format("{}: is not a recording of esim simulate: it has no scenario.yaml", recording.string()));
  }
  ScenarioText text;
  text.overrides = std::move(overrides);
  text.setter = setter;
  text.refuses = refuses;
  if (refuses) text.removed = {"renderer", "trajectory"};  // their files are not needed, and need not be allowed
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

}  // namespace

ChangedSensors change_sensors(const fs::path& recording, const std::vector<std::string>& overrides,
                              const std::string& setter, const std::function<std::string(const fs::path&)>& refuses) {
  Scenario recorded = recorded_scenario(recording, {}, setter, refuses);
  std::vector<std::string> written;
  for (const std::string& text : overrides) {
    const std::size_t equals = std::min(text.find('='), text.size());
    add_override(recorded, text.substr(0, equals), text.substr(std::min(equals + 1, text.size())), setter, written);
  }
  Scenario changed = recorded_scenario(recording, written, setter, refuses);
  return {recording, std::move(recorded), std::move(changed)};
}

SampleStoreReader open_samples(const ChangedSensors& sensors, std::size_t camera, bool read_ahead) {
  const CameraOptions& options = sensors.changed.cameras[camera];
  const fs::path file = sensors.recording / options.name / kSamplesFile;
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw RemediableError(
        fmt::format("{}: does not exist: the recording has no samples; simulate again with output.samples=true",
                    file.string()),
        Remedy::keep_samples);
  }
  SampleStoreReader store(file, read_ahead);
  const SampleStoreInfo& info = store.info();
  if (info.width != options.width || info.height != options.height) {
    throw UserError(fmt::format("{}: has {} x {} px, but camera {} of scenario.yaml has {} x {} px; simulate again",
                                file.string(), info.width, info.height, options.name, options.width, options.height));
  }
  return store;
}

std::string inexact_because(const ChangedSensors& sensors, const std::vector<SampleStoreInfo>& stores) {
  const auto& [recording, recorded, changed] = sensors;
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

Scenario sensors_only(const Scenario& scenario) {
  Scenario sensors = scenario;
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
    add_frames(camera.frame_camera, camera.event_camera);
    for (SensorOptions& sensor : camera.event_cameras) add_frames(camera.frame_camera, sensor);
    camera.frame_camera.reset();
  }
  return sensors;
}

World build_sensors(const Scenario& sensors, const SampleStoreInfo& samples, int threads, const Notices& notices) {
  Substitutes substitutes;
  substitutes.body = std::make_shared<const StaticTrajectory>(SE3{}, samples.start, samples.end - samples.start);
  substitutes.make_renderer = [](const Camera&, const Workers&) { return make_no_renderer(); };
  return build_world(sensors, substitutes, threads, notices);
}

}  // namespace esim::inline compose
