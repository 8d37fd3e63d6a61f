#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/compose/camera_renderers.h"
#include "esim/compose/compose.h"
#include "esim/core/engine_error.h"
#include "esim/formats/formats.h"
#include "esim/sampling/make_sampler.h"
#include "esim/scenario/read.h"

namespace esim::inline compose {
namespace {

/// Throws UserError for options that contradict each other, and warns of those that are probably not intended.
void check_sampling(const CameraOptions& camera, const Notices& notices) {
  const auto check = [&]<typename Criterion>(const Criterion& criterion) {
    if constexpr (requires { criterion.lambda; }) {
      if (criterion.lambda > 1) {
        notices.warning(
            fmt::format("camera {}: sampling.lambda = {} is above 1: changes between two samples are no longer bounded",
                        camera.name, criterion.lambda));
      }
    }
    if constexpr (requires { criterion.bounds; }) {
      if (criterion.bounds.min_rate_hz > criterion.bounds.max_rate_hz) {
        throw UserError(fmt::format("camera {}: sampling.min_rate_hz = {} is above max_rate_hz = {}; swap them",
                                    camera.name, criterion.bounds.min_rate_hz, criterion.bounds.max_rate_hz));
      }
    }
  };
  std::visit(check, camera.sampling);
}

/// The name of an event sensor's camera in the recording.
std::string name_of(const CameraOptions& camera, const SensorOptions& sensor) {
  return sensor.name.empty() ? camera.name : camera.name + "/" + sensor.name;
}

/// Warns of filters that the camera's sensors do not have.
void check_filters(const CameraOptions& camera, const Notices& notices) {
  for (const SensorOptions& sensor : camera.sensors()) {
    for (const std::string& line : warnings_of_filters(sensor))
      notices.warning(fmt::format("camera {}: {}", name_of(camera, sensor), line));
  }
}

/// Whether any camera sees colour.
bool sees_colour(const Scenario& scenario) {
  return std::any_of(scenario.cameras.begin(), scenario.cameras.end(),
                     [](const CameraOptions& camera) { return sees_colour(camera); });
}

/// What cameras need of the scene's textures.
SceneLook look_of(const Scenario& scenario) { return sees_colour(scenario) ? SceneLook::colour : SceneLook::luminance; }

std::unique_ptr<Sampler> build_sampler(const Scenario& scenario, const World& world, std::size_t index,
                                       Renderer& renderer, const CameraRenderers& renderers) {
  const CameraOptions& options = scenario.cameras[index];
  const Workers& workers = *world.workers;
  const Camera& model = world.info.cameras[index].model;
  const SensorTraits traits = strictest_sensor(scenario, options);
  const auto make_other = [&](const Camera& camera, const std::optional<PixelArea>& area) {
    return renderers.make(camera, area);
  };
  const SceneAccess scene{model, renderer, view_at(world, index), make_other};
  const TimeSpan span{world.info.start, world.info.end};
  try {
    return make_sampler(options.sampling, {traits, model.width, model.height, span, workers}, &scene);
  } catch (const EngineError&) {
    throw;
  } catch (const UserError& error) {
    throw UserError(fmt::format("camera {}: {}", options.name, error.what()));
  }
}

/// Sets the event sensors of a camera, and their descriptions. `numbers`: of the sensors in the recording.
void add_event_sensors(const Scenario& scenario, std::size_t index, const std::vector<int>& numbers, TimeNs start,
                       const Notices& notices, World& world) {
  const CameraOptions& options = scenario.cameras[index];
  CameraChannel& camera = world.cameras[index];
  const Camera& model = world.info.cameras[index].model;
  const bool moves = !world.info.objects.empty() || !world.info.sprites.empty();
  for (std::size_t k = 0; k < options.sensors().size(); ++k) {
    const SensorOptions& sensor = options.sensors()[k];
    const std::string name = name_of(options, sensor);
    EventCameraOptions lit = in_light_of(scenario, sensor);
    add_frames(options.frame_camera, lit);
    warn_of_noise(fmt::format("camera {}: ", name), lit, notices);
    try {
      camera.event_sensors.push_back({EventCamera(lit, model.width, model.height, sensor.seed.value_or(scenario.seed),
                                                  static_cast<std::uint16_t>(index)),
                                      numbers[k]});
    } catch (const UserError& error) {
      if (sensor.name.empty()) throw;
      throw UserError(fmt::format("camera {}: {}", name, error.what()));
    }
    const auto number = static_cast<std::size_t>(numbers[k]);
    if (!sensor.name.empty()) {
      world.info.cameras[number] = world.info.cameras[index];
      world.info.cameras[number].name = name;
      world.info.cameras[number].has_frames = false;
      world.info.cameras[number].lens = static_cast<int>(index);
    }
    world.info.cameras[number].has_labels = sensor.labels;
    if (!sensor.labels) continue;
    if (moves && !camera.seen_objects) camera.seen_objects.emplace(model.width, model.height);
    if (camera.flicker) camera.event_sensors.back().flicker_labels.emplace(model.width, model.height, start);
  }
}

/// The frame camera of a camera.
FrameCamera build_frame_camera(const CameraOptions& options, const Camera& model, const TimeSpan& span,
                               std::uint64_t seed, std::size_t index, const Notices& notices) {
  try {
    FrameCamera camera(*options.frame_camera, model.width, model.height, span, seed, static_cast<std::uint16_t>(index));
    if (camera.due() == FrameCamera::kNever) {
      notices.warning(fmt::format("camera {}: frame_camera: no exposure fits into the simulated time, {:.6g} s",
                                  options.name, to_seconds(span.end - span.start)));
    }
    return camera;
  } catch (const UserError& error) {
    throw UserError(fmt::format("camera {}: {}", options.name, error.what()));
  }
}

/// Sets the IMU of a world, and its description.
void add_imu(const RigImuOptions& options, std::uint64_t seed, World& world) {
  const SE3 T_body_imu = pose_named("imu.T_body_imu", options.T_body_imu);
  const TimeSpan span{world.info.start, world.info.end};
  world.imu = {Imu(options, span.start, seed), T_body_imu, PeriodicClock(span.start, span.end, options.rate_hz)};
  world.info.imu = {T_body_imu,
                    options.rate_hz,
                    options.gyroscope.noise_density,
                    options.gyroscope.random_walk,
                    options.accelerometer.noise_density,
                    options.accelerometer.random_walk};
}

/// Whether any pixel of a sample sees a surface.
bool sees_something(const Sample& sample) {
  const auto depth = sample.depth.pixels();
  return std::any_of(depth.begin(), depth.end(), [](float z) { return std::isfinite(z); });
}

/// Warns of options that have no effect with a renderer that draws on the sensor.
void name_what_has_no_effect(const Scenario& scenario, const World& world, std::size_t index, const Notices& notices) {
  if (!world.cameras[index].renderer->traits().on_sensor) return;
  const CameraInfo& info = world.info.cameras[index];
  if (!std::holds_alternative<NoDistortion>(info.model.distortion)) {
    notices.warning(fmt::format("camera {}: distortion has no effect: {} are drawn on the sensor", info.name,
                                world.cameras[index].renderer->traits().name));
  }
  if (index == 0 && !std::holds_alternative<StaticTrajectoryOptions>(scenario.trajectory)) {
    notices.warning(
        fmt::format("trajectory: has no effect on the images, since {} are drawn on the sensor; it is only recorded",
                    world.cameras[index].renderer->traits().name));
  }
}

void warn_of_light_without_effect(const Scenario& scenario, const Notices& notices) {
  const auto uses_light = [](const CameraOptions& camera) {
    return std::ranges::any_of(
        camera.sensors(), [](const SensorOptions& sensor) { return sensor.circuit && !sensor.circuit->white_lux; });
  };
  if (!scenario.light.white_lux || std::ranges::any_of(scenario.cameras, uses_light)) return;
  notices.warning(
      "light.white_lux: has no effect: it is for event cameras with a circuit (such as preset davis346) that have no "
      "circuit.white_lux");
}

/// Renders a few images: if a camera never sees anything, its poses or frames are wrong.
void require_a_view(const World& world, std::size_t index) {
  constexpr int kLooks = 9;
  if (world.cameras[index].renderer->traits().at_infinity) return;
  const CameraInfo& info = world.info.cameras[index];
  const auto view_at = esim::view_at(world, index);
  Sample sample;
  for (int i = 0; i < kLooks; ++i) {
    RenderRequest request = view_at(world.info.start + (world.info.end - world.info.start) / (kLooks - 1) * i);
    request.tiles = {{0, 0, info.model.width, info.model.height}};
    world.cameras[index].renderer->render(request, sample);
    if (sees_something(sample)) return;
  }
  const Eigen::Vector3d position = view_at(world.info.start).camera.T_world_body.translation;
  throw UserError(
      fmt::format("camera {} never sees the scene (it starts at {:.3g} {:.3g} {:.3g} m); check "
                  "the trajectory's frame and T_body_camera",
                  info.name, position.x(), position.y(), position.z()));
}

/// Names the moving objects and sprites, in the order in which renderers number them.
void name_what_moves(const RendererOptions& renderer, const SceneFile& scene, RecordingInfo& info) {
  for (const SceneObject& object : scene.scene.objects) {
    if (object.moves) info.objects.push_back(object.name);
  }
  if (const auto* const sprites = std::get_if<SpritesRendererOptions>(&renderer)) {
    for (std::size_t i = 0; i < sprites->sprites.size(); ++i) info.sprites.push_back(fmt::format("sprite{}", i));
  }
  if (const auto* const objects = engine_objects(renderer)) {
    for (const EngineObjectOptions& object : *objects) info.objects.push_back(object.name);
  }
}

/// Throws UserError for options that custom renderers do not support.
void check_substitutes(const Scenario& scenario, const Substitutes& substitutes, const TimeSpan& span) {
  if (!substitutes.make_renderer) return;
  if (sees_colour(scenario)) throw UserError("colour: a custom renderer gives luminance only; use colour: none");
  if (scenario.truth.event_points) {
    throw UserError(
        "truth.event_points: needs single pixels at the time of each event, which a custom renderer cannot render; "
        "remove it");
  }
  for (const Substitutes::Object& object : substitutes.objects) {
    if (object.trajectory->start() <= span.start && object.trajectory->end() >= span.end) continue;
    throw UserError(
        fmt::format("object {}: its trajectory lasts from {:.9g} to {:.9g} s, but must cover the simulation from "
                    "{:.9g} to {:.9g} s; shorten the simulation, or give the object a longer trajectory",
                    object.name, to_seconds(object.trajectory->start()), to_seconds(object.trajectory->end()),
                    to_seconds(span.start), to_seconds(span.end)));
  }
}

/// Notes formats that lose labels which the scenario requests.
void name_formats_without_labels(const Scenario& scenario, const Notices& notices) {
  const auto has_labels = [](const CameraOptions& camera) {
    return std::ranges::any_of(camera.sensors(), &SensorOptions::labels);
  };
  if (std::ranges::none_of(scenario.cameras, has_labels)) return;
  for (const std::string& name : scenario.output.formats) {
    if (format_named(name).can_hold(Content::event_labels)) continue;
    notices.warning(fmt::format(
        "output.formats: {} cannot hold the labels of events; they are only in events.h5 and in other formats that can",
        name));
  }
}

/// A world without cameras: its time, the motions of the body and of the objects, and the IMU.
World build_motions(const Scenario& scenario, const SceneFile& scene, std::shared_ptr<const Trajectory> body,
                    const TimeSpan& span, const Substitutes& substitutes, int threads, const Notices& notices) {
  World world;
  world.workers = std::make_unique<const Workers>(threads);
  world.trajectory = std::move(body);
  world.info.start = span.start;
  world.info.end = span.end;
  world.info.truth_rate_hz = scenario.truth.rate_hz;
  world.truth_clock = PeriodicClock(span.start, span.end, scenario.truth.rate_hz);
  world.pose_clock = PeriodicClock(span.start, span.end, scenario.truth.pose_rate_hz);
  if (scenario.imu) add_imu(*scenario.imu, scenario.seed, world);
  if (substitutes.make_renderer) {
    for (const Substitutes::Object& object : substitutes.objects) {
      world.objects.push_back(object.trajectory);
      world.info.objects.push_back(object.name);
    }
  } else {
    world.objects = build_object_trajectories(scenario, scene, *world.trajectory, span, notices);
    name_what_moves(scenario.renderer, scene, world.info);
  }
  return world;
}

/// Everything. All other functions that build a world end here.
World build(const Scenario& scenario, const SceneFile& scene, std::shared_ptr<const Trajectory> body,
            const TimeSpan& span, const Substitutes& substitutes, int threads, const Notices& notices,
            const std::shared_ptr<ImageCache>& cache = nullptr, const RendererFactory* renderers_of_scene = nullptr) {
  std::ranges::for_each(scenario.notices, notices.warning);
  check_substitutes(scenario, substitutes, span);
  World world = build_motions(scenario, scene, std::move(body), span, substitutes, threads, notices);
  const SceneCamera* const followed = substitutes.body != nullptr ? nullptr : followed_camera(scenario, scene);
  check_output(scenario);
  name_formats_without_labels(scenario, notices);
  warn_of_light_without_effect(scenario, notices);
  for (const CameraOptions& options : scenario.cameras) {
    check_sampling(options, notices);
    check_filters(options, notices);
    world.info.cameras.push_back(camera_info(options, followed));
  }
  const RendererFactory make_renderer =
      renderers_of_scene != nullptr ? *renderers_of_scene
      : substitutes.make_renderer
          ? RendererFactory{[&](const Camera& camera, ColourFilters, const Workers& workers) {
              return substitutes.make_renderer(camera, workers);
            }}
          : build_renderer_factory(scenario.renderer, scene, sees_colour(scenario), world.info.cameras, notices, cache);
  const std::vector<std::vector<int>> numbers = sensor_numbers(scenario);
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
    const CameraOptions& options = scenario.cameras[i];
    const Camera model = world.info.cameras[i].model;
    const bool sees_more = !substitutes.make_renderer && engine_objects(scenario.renderer) == nullptr;
    const CameraRenderers renderers(make_renderer, options, model, sees_more, *world.workers);
    std::unique_ptr<Renderer> renderer = renderers.make();
    std::unique_ptr<Sampler> sampler = build_sampler(scenario, world, i, *renderer, renderers);
    world.cameras.push_back({std::move(renderer), std::move(sampler)});
    world.cameras.back().flicker = build_flicker(scenario, options, world.info.objects.size(), span.start);
    if (options.frame_camera)
      world.cameras.back().frame_camera = build_frame_camera(options, model, span, scenario.seed, i, notices);
    require_a_view(world, i);
    name_what_has_no_effect(scenario, world, i, notices);
  }
  for (const std::vector<int>& camera : numbers) {
    for (const int number : camera)
      world.info.cameras.resize(std::max(world.info.cameras.size(), static_cast<std::size_t>(number) + 1));
  }
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i)
    add_event_sensors(scenario, i, numbers[i], span.start, notices, world);
  prepare_truth(scenario, scene, make_renderer, notices, world);
  return world;
}

}  // namespace

TimeSpan simulated_span(const Scenario& scenario, const Trajectory& trajectory) {
  const TimeNs start = trajectory.start() + to_ns(scenario.start_s);
  const double available_s = to_seconds(trajectory.end() - start);
  if (available_s <= 0) {
    throw UserError(fmt::format("start_s: {} s is beyond the end of the trajectory, which lasts {:.3f} s",
                                scenario.start_s, to_seconds(trajectory.end() - trajectory.start())));
  }
  if (!scenario.duration_s) return {start, trajectory.end()};
  const TimeNs end = start + to_ns(*scenario.duration_s);
  if (end > trajectory.end()) {
    throw UserError(
        fmt::format("duration_s: {} s is longer than the rest of the trajectory, {:.9g} s; shorten it, or make the "
                    "trajectory longer (for a trajectory file, with trajectory.time_scale)",
                    *scenario.duration_s, available_s));
  }
  return {start, end};
}

std::vector<std::vector<int>> sensor_numbers(const Scenario& scenario) {
  std::vector<std::vector<int>> numbers(scenario.cameras.size());
  int next = static_cast<int>(scenario.cameras.size());
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
    for (const SensorOptions& sensor : scenario.cameras[i].sensors())
      numbers[i].push_back(sensor.name.empty() ? static_cast<int>(i) : next++);
  }
  return numbers;
}

SensorTraits strictest_sensor(const Scenario& scenario, const CameraOptions& camera) {
  const auto traits_of = [&](const EventCameraOptions& sensor) {
    const EventCameraOptions lit = in_light_of(scenario, sensor);
    return SensorTraits{lit.min_threshold(), lit.dark_light(), sees_colour(camera)};
  };
  SensorTraits strictest = traits_of(camera.first_sensor());
  for (const SensorOptions& sensor : camera.sensors()) {
    const SensorTraits traits = traits_of(sensor);
    strictest.contrast_threshold = std::min(strictest.contrast_threshold, traits.contrast_threshold);
    strictest.log_eps = std::min(strictest.log_eps, traits.log_eps);
  }
  return strictest;
}

bool sampling_depends_on_sensors(const CameraOptions& camera) {
  return !std::holds_alternative<UniformSampling>(camera.sampling) &&
         !std::holds_alternative<FlowSampling>(camera.sampling);
}

bool seed_determines_more_than_events(const Scenario& scenario) {
  const auto is_random = [](const TrajectoryOptions& trajectory) {
    return std::holds_alternative<RandomTrajectoryOptions>(trajectory);
  };
  const auto moves_randomly = [&](const auto& object) { return is_random(object.trajectory); };
  const auto* const listed = listed_objects(scenario.renderer);
  const auto* const objects = engine_objects(scenario.renderer);
  return is_random(scenario.trajectory) || (listed != nullptr && std::ranges::any_of(*listed, moves_randomly)) ||
         (objects != nullptr && std::ranges::any_of(*objects, moves_randomly)) || scenario.imu ||
         std::ranges::any_of(scenario.cameras,
                             [](const CameraOptions& camera) { return camera.frame_camera.has_value(); });
}

CameraInfo camera_info(CameraOptions options, const SceneCamera* followed) {
  if (followed != nullptr && followed->horizontal_fov_rad && !options.horizontal_fov_deg)
    options.horizontal_fov_deg = *followed->horizontal_fov_rad * 180.0 / std::numbers::pi;
  return {options.name, camera_model(options),
          pose_named(fmt::format("camera {}: T_body_camera", options.name), options.T_body_camera),
          options.frame_camera.has_value()};
}

World build_world(const Scenario& scenario, int threads, const Notices& notices,
                  const std::shared_ptr<ImageCache>& cache) {
  return build_world(scenario, Substitutes{}, threads, notices, cache);
}

World build_world(const Scenario& scenario, const Substitutes& substitutes, int threads, const Notices& notices,
                  const std::shared_ptr<ImageCache>& cache) {
  SceneFile scene = substitutes.make_renderer ? SceneFile{} : load_scenes(scenario, look_of(scenario), notices);
  std::shared_ptr<const Trajectory> body =
      substitutes.body != nullptr ? substitutes.body : build_trajectory(scenario, scene, notices);
  play_deformations(scenario, body->start(), scene);
  const TimeSpan span = simulated_span(scenario, *body);
  return build(scenario, scene, std::move(body), span, substitutes, threads, notices, cache);
}

struct LoadedScene {
  SceneFile scene;
  RendererFactory renderers;
};

std::shared_ptr<const LoadedScene> load_scene(const Scenario& scenario, const Notices& notices) {
  SceneFile scene = load_scenes(scenario, look_of(scenario), notices);
  play_deformations(scenario, 0, scene);
  std::vector<CameraInfo> cameras;
  for (const CameraOptions& options : scenario.cameras)
    cameras.push_back(camera_info(options, followed_camera(scenario, scene)));
  RendererFactory renderers = build_renderer_factory(scenario.renderer, scene, sees_colour(scenario), cameras, notices);
  return std::make_shared<const LoadedScene>(LoadedScene{std::move(scene), std::move(renderers)});
}

std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const LoadedScene& loaded,
                                                   const Notices& notices) {
  return build_trajectory(scenario, loaded.scene, notices);
}

World build_world(const Scenario& scenario, const LoadedScene& loaded, std::shared_ptr<const Trajectory> body,
                  int threads, const Notices& notices) {
  if (!scenario.duration_s) throw UserError("duration_s: is missing; an online motion does not define one");
  if (body->start() != 0 && std::ranges::any_of(loaded.scene.scene.objects, &SceneObject::deforms))
    throw UserError("an online motion must start at 0 s if the scene deforms");
  const TimeNs start = body->start() + to_ns(scenario.start_s);
  const TimeSpan span{start, start + to_ns(*scenario.duration_s)};
  return build(scenario, loaded.scene, std::move(body), span, Substitutes{}, threads, notices, nullptr,
               &loaded.renderers);
}

World build_world(const Scenario& scenario, std::shared_ptr<const Trajectory> body, int threads,
                  const Notices& notices) {
  return build_world(scenario, *load_scene(scenario, notices), std::move(body), threads, notices);
}

}  // namespace esim::inline compose
