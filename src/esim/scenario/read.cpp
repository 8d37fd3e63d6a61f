#include "esim/scenario/read.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <set>

#include "esim/core/inputs/used_files.h"
#include "esim/geometry/calibration.h"
#include "esim/scenario/sprite_scene.h"
#include "esim/scenario/variation/sensor_list.h"
#include "esim/scenario/waypoint_file.h"
#include "esim/scenario/yaml/inherit.h"
#include "esim/scenario/yaml/renamed_keys.h"
#include "esim/scenario/yaml/yaml_reader.h"

namespace esim::inline scenario {
namespace {

constexpr std::array<const char*, 4> kInherited{"sampling", "event_camera", "event_cameras", "frame_camera"};

/// The same source, in which what was set for all cameras on the command line is also set for the camera `key`.
YamlSource with_inherited(YamlSource source, const std::string& key) {
  const std::vector<std::string> changed = source.changed;
  for (const std::string& set : changed) {
    const bool inherited = std::any_of(kInherited.begin(), kInherited.end(),
                                       [&](const char* part) { return set.substr(0, set.find('.')) == part; });
    if (inherited) source.changed.push_back(key + "." + set);
  }
  return source;
}

/// One camera for each camera of the calibration file; the camera itself if it names none.
std::vector<CameraOptions> with_calibration(const CameraOptions& options) {
  if (options.calibration.empty()) return {options};
  std::vector<CameraOptions> cameras;
  for (const CalibratedCamera& calibrated : read_calibration(options.calibration)) {
    CameraOptions camera = options;
    camera.calibration.clear();
    const Camera& model = calibrated.model;
    camera.width = model.width, camera.height = model.height;
    camera.fx = model.fx, camera.fy = model.fy, camera.cx = model.cx, camera.cy = model.cy;
    camera.T_body_camera = options_of(calibrated.T_body_camera);
    struct ToOptions {
      DistortionOptions operator()(const NoDistortion&) const { return NoDistortionOptions{}; }
      DistortionOptions operator()(const RadialTangential& d) const { return RadialTangentialOptions{d}; }
      DistortionOptions operator()(const Equidistant& d) const { return EquidistantOptions{d}; }
      DistortionOptions operator()(const Fov& d) const { return FovOptions{d}; }
    };
    camera.distortion = std::visit(ToOptions{}, model.distortion);
    cameras.push_back(camera);
  }
  return cameras;
}

/// Throws OptionError for keys of a camera that its calibration file would override.
void refuse_geometry_beside_calibration(const YAML::Node& entry, const std::string& key, const YamlSource& source) {
  if (!entry["calibration"].IsDefined()) return;
  for (const char* name :
       {"width", "height", "horizontal_fov_deg", "fx", "fy", "cx", "cy", "distortion", "T_body_camera"}) {
    if (entry[name].IsDefined()) {
      YamlReader::fail(source, entry[name], key + "." + name,
                       "must not be given together with a calibration file, which sets it; remove one of them");
    }
  }
}

/// The value of a dotted key; if it is missing, that of the innermost map or list that should contain it.
YAML::Node find_innermost(const YAML::Node& root, const std::string& key) {
  YAML::Node node = root;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    const std::string part = key.substr(begin, end - begin);
    const YAML::Node& parent = node;
    const YAML::Node child = parent.IsSequence() ? parent[std::stoul(part)] : parent[part];
    if (!child.IsDefined()) return node;
    node.reset(child);
    begin = end + 1;
  }
  return node;
}

/// Throws OptionError if filters contradict each other or do not suit the size of the camera, whose map is `node`.
void check_filters(const CameraOptions& camera, const YAML::Node& node, const std::string& key,
                   const YamlSource& source) {
  for (const SensorOptions& sensor : camera.sensors()) {
    const auto problem = find_problem(sensor.filters, camera.width, camera.height);
    if (!problem) continue;
    const std::string option = "event_camera.filters." + problem->key;
    if (camera.event_cameras.empty())
      YamlReader::fail(source, find_innermost(node, option), key + "." + option, problem->problem);
    YamlReader::fail(source, node["event_cameras"], key + ".event_cameras",
                     fmt::format("{}: filters.{}: {}", sensor.name, problem->key, problem->problem));
  }
}

/// The default sampling method: flow for renderers of complete images and for parts that the scenario does not
/// describe (custom renderers and online motion), keyframes if another program renders, otherwise adaptive.
SamplingOptions usual_sampling(const RendererOptions& renderer, bool described) {
  if (engine_objects(renderer) != nullptr) return KeyframeSampling{};
  if (described && on_processor(renderer)) return AdaptiveSampling{};
  return FlowSampling{};
}

/// `otherwise` holds the default values of a camera, `seed` is that of the scenario.
std::vector<CameraOptions> read_cameras(const YAML::Node& root, const YamlSource& source,
                                        const CameraOptions& otherwise, std::uint64_t seed) {
  const YAML::Node one = root["camera"], several = root["cameras"];
  if (one.IsDefined() && several.IsDefined())
    YamlReader::fail(source, several, "cameras", "must not be given together with camera; remove one of them");
  if (several.IsDefined() && (!several.IsSequence() || several.size() == 0))
    YamlReader::fail(source, several, "cameras", "must be a list of at least one camera");

  std::vector<CameraOptions> cameras;
  SensorList sensor_list(seed);
  const std::size_t count = several.IsDefined() ? several.size() : 1;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string key = several.IsDefined() ? fmt::format("cameras.{}", i) : "camera";
    const YAML::Node entry = several.IsDefined() ? several[i] : one;
    const YamlSource of_camera = with_inherited(source, key);
    YAML::Node map = entry.IsDefined() ? entry : YAML::Node(YAML::NodeType::Map);
    if (map.IsMap()) {
      YAML::Node parts(YAML::NodeType::Map);
      for (const char* part : kInherited) {
        const YAML::Node inherited = inherit(root[part], std::as_const(map)[part]);
        if (inherited.IsDefined()) parts.force_insert(part, inherited);
      }
      map.reset(merged(map, parts));
      refuse_geometry_beside_calibration(std::as_const(map), key, of_camera);
    }
    std::vector<SensorOptions> sensors;
    if (map.IsMap()) {
      const YAML::Node& given = std::as_const(map);
      sensors = sensor_list.read(given["event_camera"], given["event_cameras"], key, of_camera);
    }
    CameraOptions options = otherwise;
    const YAML::Node others = sensors.empty() ? map : without(map, {"event_camera", "event_cameras"});
    YamlReader reader(others, key, of_camera);
    describe(reader, options);
    reader.finish();
    options.event_cameras = std::move(sensors);
    for (CameraOptions& camera : with_calibration(options)) {
      check_filters(camera, std::as_const(map), key, of_camera);
      cameras.push_back(std::move(camera));
    }
  }
  return cameras;
}

/// Replaces the calibration file of an IMU by its contents.
void read_imu(RigImuOptions& imu, const YAML::Node& node, const YamlSource& source) {
  if (imu.calibration.empty()) return;
  const auto refuse = [&](const YAML::Node& given, const std::string& key) {
    if (given.IsDefined())
      YamlReader::fail(source, given, "imu." + key,
                       "must not be given together with a calibration file, which sets it; remove one of them");
  };
  refuse(node["rate_hz"], "rate_hz");
  for (const std::string sensor : {"gyroscope", "accelerometer"}) {
    if (!node[sensor].IsDefined()) continue;
    for (const std::string key : {"noise_density", "random_walk"}) refuse(node[sensor][key], sensor + "." + key);
  }
  const CalibratedImu calibrated = read_imu_calibration(imu.calibration);
  imu.calibration.clear();
  imu.rate_hz = calibrated.rate_hz;
  imu.gyroscope.noise_density = calibrated.gyroscope_noise_density;
  imu.gyroscope.random_walk = calibrated.gyroscope_random_walk;
  imu.accelerometer.noise_density = calibrated.accelerometer_noise_density;
  imu.accelerometer.random_walk = calibrated.accelerometer_random_walk;
}

bool is_plain(const std::string& name) {
  return name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
         std::string::npos;
}

/// Gives every camera a unique name that is also valid for a folder.
void name_cameras(std::vector<CameraOptions>& cameras, const YamlSource& source) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::string& name = cameras[i].name;
    if (name.empty()) name = fmt::format("cam{}", i);
    if (!is_plain(name))
      throw UserError(
          fmt::format("{}: camera name '{}': must consist of letters, digits, _ and -", source.file.string(), name));
    if (!names.insert(name).second)
      throw UserError(fmt::format("{}: two cameras are named {}; rename one", source.file.string(), name));
  }
}

/// Throws UserError unless the names of a camera's sensors are unique and valid for folders beside the camera's others.
void check_sensor_names(const CameraOptions& camera, const std::vector<std::string>& formats,
                        const YamlSource& source) {
  std::set<std::string> names;
  const auto fail = [&](const std::string& problem) {
    throw UserError(fmt::format("{}: camera {}: {}", source.file.string(), camera.name, problem));
  };
  for (const SensorOptions& sensor : camera.sensors()) {
    const std::string& name = sensor.name;
    if (!is_plain(name)) fail(fmt::format("sensor name '{}': must consist of letters, digits, _ and -", name));
    if (name == "images" || name == "frames" || std::ranges::find(formats, name) != formats.end())
      fail(fmt::format("sensor name '{}': is the name of another folder of the recording; choose another", name));
    if (!names.insert(name).second) fail(fmt::format("two event sensors are named {}; rename one", name));
  }
}

/// Replaces the scene file, if given, by its sprites; the camera gets the size given in the file.
void read_sprites(SpritesRendererOptions& renderer, const YAML::Node& node, const YamlSource& source,
                  CameraOptions& camera) {
  if (renderer.scene.empty()) return;
  if (!renderer.sprites.empty()) {
    YamlReader::fail(source, node["sprites"], "renderer.sprites",
                     "must not be given together with a scene file, which sets them; remove one");
  }
  SpriteSceneFile scene = read_sprite_scene(renderer.scene, renderer.search_path);
  renderer.sprites = std::move(scene.sprites);
  renderer.scene.clear();
  renderer.search_path.clear();
  camera.width = scene.width, camera.height = scene.height;
}

/// Replaces the file of waypoints, if given, by its points.
void read_points(TrajectoryOptions& trajectory, const YAML::Node& node, const std::string& key,
                 const YamlSource& source, bool may_be_missing) {
  auto* const options = std::get_if<WaypointTrajectoryOptions>(&trajectory);
  if (options == nullptr) return;
  if (!options->file.empty() && !options->points.empty())
    YamlReader::fail(source, node["points"], key + ".points",
                     "must not be given together with file; remove one of them");
  if (options->file.empty() && options->points.empty())
    YamlReader::fail(source, node, key, "has no points; list them in points, or name a file of waypoints in file");
  std::error_code error;
  if (options->file.empty() || (may_be_missing && !std::filesystem::exists(options->file, error))) return;
  options->points = read_waypoints(options->file);
  options->points_file = options->file;
  options->file.clear();
}

/// The time of the last pose of all sprites; 0 without poses.
double last_pose_s(const SpritesRendererOptions& renderer) {
  double last = 0;
  for (const SpriteOptions& sprite : renderer.sprites) {
    for (const SpritePose& pose : sprite.poses) last = std::max(last, pose.t_s);
  }
  return last;
}

/// Sprites lie on the sensor, so that their scenario needs no trajectory. Unless its trajectory defines a duration, it
/// ends with the last pose.
void complete_for_sprites(Scenario& scenario, const SpritesRendererOptions& renderer, bool has_trajectory) {
  if (!has_trajectory) scenario.trajectory = StaticTrajectoryOptions{};
  const double end_s = last_pose_s(renderer);
  const bool has_end = std::visit([](const auto& trajectory) { return trajectory.kHasDuration; }, scenario.trajectory);
  if (scenario.duration_s || end_s <= 0 || has_end) return;
  if (scenario.start_s >= end_s) {
    throw UserError(
        fmt::format("start_s: {} s is beyond the last pose of the sprites, at {} s; start earlier, or set "
                    "duration_s",
                    scenario.start_s, end_s));
  }
  scenario.duration_s = end_s - scenario.start_s;
}

}  // namespace

Scenario read_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  ScenarioText text;
  text.overrides = overrides;
  return read_scenario(file, text);
}

Scenario read_scenario(const std::filesystem::path& file, ScenarioText otherwise) {
  otherwise.yaml = text_of(file, "scenario file");
  otherwise.file = file;
  return read_scenario(otherwise);
}

Scenario read_scenario(const ScenarioText& text) {
  std::vector<UsedFile> files;
  if (text.has_lines) files.push_back(used_text(text.file, text.yaml));
  const UsedFilesListener listener([&](const UsedFile& file) { files.push_back(file); });
  YAML::Node root = parse_yaml(text.yaml, text.file);
  YamlSource source{text.file, {}, text.setter, text.has_lines, text.refuses};
  if (!root.IsMap()) YamlReader(root, "", source);
  Scenario scenario;
  use_present_names(root, source, scenario.notices);
  for (const std::string& key : text.removed) remove_option(root, with_present_names(key, scenario.notices));
  for (const std::string& change : text.overrides) {
    const std::size_t equals = std::min(change.find('='), change.size());
    const std::string present = with_present_names(change.substr(0, equals), scenario.notices);
    source.changed.push_back(apply_override(root, present + change.substr(equals), text.setter));
  }
  use_present_names(root, source, scenario.notices);  // in values of overrides

  YamlReader reader(root, "", source);
  describe(reader, scenario);
  for (const char* key : {"camera", "cameras", "sampling", "event_camera", "event_cameras", "frame_camera"})
    reader.know(key);
  reader.finish();
  const YAML::Node renderer = std::as_const(root)["renderer"], trajectory = std::as_const(root)["trajectory"];
  auto* const sprites = std::get_if<SpritesRendererOptions>(&scenario.renderer);
  const auto require = [&](const char* key, bool needed) {
    if (needed && !std::as_const(root)[key].IsDefined() && sprites == nullptr)
      YamlReader::fail(source, YAML::Node(YAML::NodeType::Undefined), key, "is missing; every scenario needs it");
  };
  require("renderer", text.needs_renderer);
  require("trajectory", text.needs_trajectory);
  if (scenario.imu) read_imu(*scenario.imu, std::as_const(root)["imu"], source);
  read_points(scenario.trajectory, trajectory, "trajectory", source, !text.needs_waypoints);
  std::visit(
      [&](auto& options) {
        if constexpr (requires { options.objects; }) {
          for (std::size_t i = 0; i < options.objects.size(); ++i) {
            read_points(options.objects[i].trajectory, renderer["objects"][i]["trajectory"],
                        fmt::format("renderer.objects.{}.trajectory", i), source, false);
          }
        }
      },
      scenario.renderer);
  CameraOptions camera;
  camera.sampling = usual_sampling(scenario.renderer, text.needs_renderer && text.needs_trajectory);
  if (sprites != nullptr) {
    read_sprites(*sprites, renderer, source, camera);
    complete_for_sprites(scenario, *sprites, trajectory.IsDefined());
  }
  scenario.cameras = read_cameras(std::as_const(root), source, camera, scenario.seed);
  name_cameras(scenario.cameras, source);
  for (const CameraOptions& each : scenario.cameras) check_sensor_names(each, scenario.output.formats, source);
  scenario.files = std::move(files);
  return scenario;
}

EventCameraOptions in_light_of(const Scenario& scenario, const EventCameraOptions& sensor) {
  EventCameraOptions options = sensor;
  if (options.circuit && !options.circuit->white_lux) options.circuit->white_lux = scenario.light.white_lux;
  return options;
}

void add_frames(const std::optional<FrameCameraOptions>& frames, EventCameraOptions& sensor) {
  if (!sensor.circuit || !frames) return;
  CircuitOptions& circuit = *sensor.circuit;
  if (!circuit.frame_rate_hz) circuit.frame_rate_hz = frames->rate_hz;
  if (!circuit.frame_exposure_ms) circuit.frame_exposure_ms = 1e3 * frames->exposure_s;
}

Camera camera_model(const CameraOptions& options) {
  constexpr double kDefaultFov_deg = 75;
  const double fov_deg = options.horizontal_fov_deg.value_or(kDefaultFov_deg);
  Camera camera = Camera::from_fov(options.width, options.height, fov_deg * std::numbers::pi / 180.0);
  if (options.fx) camera.fx = camera.fy = *options.fx;
  if (options.fy) camera.fy = *options.fy;
  if (options.cx) camera.cx = *options.cx;
  if (options.cy) camera.cy = *options.cy;
  struct ToModel {
    Distortion operator()(const NoDistortionOptions&) const { return NoDistortion{}; }
    Distortion operator()(const RadialTangentialOptions& d) const { return RadialTangential{d}; }
    Distortion operator()(const EquidistantOptions& d) const { return Equidistant{d}; }
    Distortion operator()(const FovOptions& d) const { return Fov{d}; }
  };
  camera.distortion = std::visit(ToModel{}, options.distortion);
  try {
    camera.validate();
  } catch (const UserError& error) {
    throw UserError(fmt::format("camera {}: {}", options.name, error.what()));
  }
  return camera;
}

}  // namespace esim::inline scenario
