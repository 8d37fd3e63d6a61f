#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "esim/compose/compose.h"
#include "esim/compose/waypoint_trajectory.h"
#include "esim/core/error.h"
#include "esim/motion/fit/fit.h"
#include "esim/motion/random.h"
#include "esim/motion/resting.h"
#include "esim/motion/static.h"
#include "esim/motion/trajectory_file.h"

namespace esim::inline compose {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// The body or object whose motion is built, and what applies if its options leave it open.
struct Mover {
  std::string key;                                                  ///< of its options, for messages
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< if its options give none
  std::uint64_t seed = 0;
  std::uint16_t stream = 0;  ///< of random numbers
  std::function<TimeSpan()> span;
  const SceneFile* scene = nullptr;  ///< with the cameras that it may follow
  double time_scale = 1;             ///< of that file's animation
  bool has_duration = false;         ///< whether the scenario gives one
  SE3 T_body_camera;                 ///< of the camera that waypoints aim
};

std::shared_ptr<const Trajectory> fit(const std::vector<TimedPose>& poses, const FitOptions& options,
                                      const std::string& name, const Notices& notices) {
  const FittedTrajectory fitted = fit_trajectory(poses, options);
  const FitReport& fit = fitted.report;
  notices.note(
      fmt::format("{}: fitted {} poses by a spline with a knot every {:.1f} ms; residual {:.3f} mm rms "
                  "({:.3f} max), {:.4f} deg rms ({:.4f} max)",
                  name, poses.size(), fit.knot_interval_s * 1e3, fit.rms_position_m * 1e3, fit.max_position_m * 1e3,
                  fit.rms_rotation_rad / kDegree, fit.max_rotation_rad / kDegree));
  return std::make_shared<const SplineTrajectory>(fitted.trajectory);
}

/// A motion of the scene file, shifted so that it begins at `start`.
std::shared_ptr<const Trajectory> fit_animation(const SceneMotion& motion, TimeNs start, double time_scale,
                                                const std::string& name, const Notices& notices) {
  std::vector<TimedPose> poses;
  for (const ScenePose& pose : motion) {
    const double since_start = static_cast<double>(pose.t - motion.front().t);
    poses.push_back({start + std::llround(since_start * time_scale), pose.T_world_object});
  }
  try {
    return fit(poses, {}, name, notices);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: cannot fit its animation: {}", name, error.what()));
  }
}

/// Says what a file of images' poses leaves open: their rate and, unless `up` is given, which way is up.
void note_images(const TrajectoryFile& file, const FileTrajectoryOptions& options, const std::string& key,
                 const Notices& notices) {
  if (!file.rate_hz && !file.image_up) return;
  std::string text = fmt::format("{} {}: {} poses", key, options.path.string(), file.poses.size());
  if (file.rate_hz) text += fmt::format(" at {:g} Hz", *file.rate_hz);
  if (file.image_up && !options.up) {
    const auto rounded = [](double value) { return std::round(100 * value) / 100 + 0.0; };  // no -0
    const Eigen::Vector3d up = file.image_up->unaryExpr(rounded);
    text += fmt::format("; the images' mean up direction is [{:.2f}, {:.2f}, {:.2f}]; {}.up turns it to z", up.x(),
                        up.y(), up.z(), key);
  }
  notices.note(text);
}

// One overload per type of trajectory.

std::shared_ptr<const Trajectory> build(const FileTrajectoryOptions& options, const Mover& mover,
                                        const Notices& notices) {
  if (options.path.empty()) throw UserError(fmt::format("{}.path: is missing; name a file of poses", mover.key));
  const TrajectoryFileOptions coordinates{options.rate_hz, options.scale, options.up};
  try {
    check_options(coordinates);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}.{}", mover.key, error.what()));
  }
  TrajectoryFile file = read_trajectory_file(options.path, coordinates);
  note_images(file, options, mover.key, notices);
  std::vector<TimedPose>& poses = file.poses;
  for (TimedPose& pose : poses) pose.t = std::llround(static_cast<double>(pose.t) * options.time_scale);
  try {
    return fit(poses, {options.order, options.knot_interval_s, options.smoothing_time_s}, mover.key, notices);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: {}", options.path.string(), error.what()));
  }
}

std::shared_ptr<const Trajectory> build(const RandomTrajectoryOptions& options, const Mover& mover, const Notices&) {
  RandomMotionOptions motion;
  motion.position_amplitude_m = options.position_amplitude_m;
  motion.rotation_amplitude_rad = options.rotation_amplitude_deg * kDegree;
  motion.knot_interval_s = options.knot_interval_s;
  motion.center = pose_of(options.center, mover.orientation);
  motion.order = options.order;
  const TimeSpan span = mover.span();
  return std::make_shared<const SplineTrajectory>(
      random_trajectory(motion, span.start, span.end - span.start, mover.seed, mover.stream));
}

std::shared_ptr<const Trajectory> build(const StaticTrajectoryOptions& options, const Mover& mover, const Notices&) {
  const TimeSpan span = mover.span();
  return std::make_shared<const StaticTrajectory>(pose_of(options.pose, mover.orientation), span.start,
                                                  span.end - span.start);
}

const SceneCamera& find_camera(const SceneTrajectoryOptions& options, const Mover& mover) {
  if (mover.scene == nullptr || (mover.scene->scene.objects.empty() && mover.scene->cameras.empty())) {
    throw UserError(fmt::format(
        "{}: type scene needs a renderer of type mesh or blender, whose scene file has a camera, and is for the "
        "body only; use file, random or static",
        mover.key));
  }
  const std::vector<SceneCamera>& cameras = mover.scene->cameras;
  std::string names;
  for (const SceneCamera& camera : cameras) {
    if (camera.name == options.camera || (cameras.size() == 1 && options.camera.empty())) return camera;
    names += (names.empty() ? "" : ", ") + camera.name;
  }
  if (cameras.empty())
    throw UserError(fmt::format("{}: the scene file has no camera; use file, random or static", mover.key));
  if (options.camera.empty())
    throw UserError(
        fmt::format("{}.camera: is missing, but the scene file has several cameras; name one of {}", mover.key, names));
  throw UserError(
      fmt::format("{}.camera: the scene file has no camera '{}'; name one of {}", mover.key, options.camera, names));
}

std::shared_ptr<const Trajectory> build(const SceneTrajectoryOptions& options, const Mover& mover,
                                        const Notices& notices) {
  const SceneCamera& camera = find_camera(options, mover);
  if (camera.motion.size() > 1) {
    const TimeNs start = std::llround(static_cast<double>(camera.motion.front().t) * mover.time_scale);
    return fit_animation(camera.motion, start, mover.time_scale, "camera " + camera.name, notices);
  }
  // A static camera sees the complete animation.
  const TimeSpan& animation = mover.scene->animation;
  const auto scaled = [&](TimeNs t) { return std::llround(static_cast<double>(t) * mover.time_scale); };
  const TimeSpan span = animation.end > animation.start && !mover.has_duration
                            ? TimeSpan{scaled(animation.start), scaled(animation.end)}
                            : mover.span();
  return std::make_shared<const StaticTrajectory>(camera.motion.front().T_world_object, span.start,
                                                  span.end - span.start);
}

std::shared_ptr<const Trajectory> build(const WaypointTrajectoryOptions& options, const Mover& mover,
                                        const Notices& notices) {
  auto trajectory =
      std::make_shared<const WaypointTrajectory>(waypoint_trajectory(options, mover.T_body_camera, mover.key));
  notices.note(fmt::format("{}: {} waypoints in {:.3f} s", mover.key, options.points.size(),
                           to_seconds(trajectory->end() - trajectory->start())));
  return trajectory;
}

/// The motion of any type. Its name differs from the overloads above: otherwise, a type without an overload would
/// convert to TrajectoryOptions and call this function forever.
std::shared_ptr<const Trajectory> build_any(const TrajectoryOptions& options, const Mover& mover,
                                            const Notices& notices) {
  return std::visit([&](const auto& alternative) { return build(alternative, mover, notices); }, options);
}

/// The motion of the renderer's object with this index; over `span` if its trajectory does not define a duration.
std::shared_ptr<const Trajectory> build_for_object(const TrajectoryOptions& options, std::size_t index,
                                                   const Scenario& scenario, const TimeSpan& span,
                                                   const TimeSpan& simulated, const Notices& notices) {
  Mover mover;
  mover.key = fmt::format("renderer.objects.{}.trajectory", index);
  mover.seed = scenario.seed;
  mover.stream = static_cast<std::uint16_t>(index + 1);
  mover.span = [&] { return span; };
  auto trajectory = build_any(options, mover, notices);
  if (trajectory->start() > simulated.start || trajectory->end() < simulated.end) {
    throw UserError(
        fmt::format("{}: lasts from {:.9g} to {:.9g} s, but must cover the simulation from {:.9g} to {:.9g} s; shorten "
                    "the simulation with start_s and duration_s, or stretch the trajectory with its time_scale",
                    mover.key, to_seconds(trajectory->start()), to_seconds(trajectory->end()),
                    to_seconds(simulated.start), to_seconds(simulated.end)));
  }
  return trajectory;
}

}  // namespace

const SceneCamera* followed_camera(const Scenario& scenario, const SceneFile& scene) {
  const auto* const options = std::get_if<SceneTrajectoryOptions>(&scenario.trajectory);
  if (options == nullptr) return nullptr;
  Mover mover;
  mover.key = "trajectory";
  mover.scene = &scene;
  return &find_camera(*options, mover);
}

std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const SceneFile& scene,
                                                   const Notices& notices) {
  Mover mover;
  mover.key = "trajectory";
  mover.orientation = looking_along(Eigen::Vector3d::UnitX());
  mover.seed = scenario.seed;
  mover.span = [&]() -> TimeSpan {
    if (!scenario.duration_s)
      throw UserError("duration_s: is missing; a random or static trajectory does not define one");
    return {0, to_ns(scenario.start_s + *scenario.duration_s)};
  };
  mover.scene = &scene;
  if (const auto* const mesh = std::get_if<MeshRendererOptions>(&scenario.renderer))
    mover.time_scale = mesh->time_scale;
  mover.has_duration = scenario.duration_s.has_value();
  if (!scenario.cameras.empty()) {
    const CameraOptions& camera = scenario.cameras.front();
    mover.T_body_camera = pose_named(fmt::format("camera {}: T_body_camera", camera.name), camera.T_body_camera);
  }
  return build_any(scenario.trajectory, mover, notices);
}

std::vector<std::shared_ptr<const Trajectory>> build_object_trajectories(const Scenario& scenario,
                                                                         const SceneFile& scene, const Trajectory& body,
                                                                         const TimeSpan& simulated,
                                                                         const Notices& notices) {
  std::vector<std::shared_ptr<const Trajectory>> trajectories;
  const TimeSpan span{body.start(), simulated.end};
  if (const auto* const objects = engine_objects(scenario.renderer)) {
    for (std::size_t i = 0; i < objects->size(); ++i)
      trajectories.push_back(build_for_object((*objects)[i].trajectory, i, scenario, span, simulated, notices));
  }
  const auto* const listed = listed_objects(scenario.renderer);
  if (listed == nullptr) return trajectories;
  const auto* const mesh = std::get_if<MeshRendererOptions>(&scenario.renderer);
  const double time_scale = mesh != nullptr ? mesh->time_scale : 1;
  std::size_t animated = 0;
  for (const SceneObject& object : scene.scene.objects) {
    if (!object.moves || animated == scene.motions.size()) continue;
    const SceneMotion& motion = scene.motions[animated++];
    if (motion.size() == 1) {
      trajectories.push_back(
          std::make_shared<const StaticTrajectory>(motion.front().T_world_object, span.start, span.end - span.start));
      continue;
    }
    auto animation = fit_animation(motion, body.start(), time_scale, "object " + object.name, notices);
    if (animation->end() < simulated.end)
      animation = std::make_shared<const RestingTrajectory>(std::move(animation), simulated.end);
    trajectories.push_back(std::move(animation));
  }
  for (std::size_t i = 0; i < listed->size(); ++i)
    trajectories.push_back(build_for_object((*listed)[i].trajectory, i, scenario, span, simulated, notices));
  return trajectories;
}

}  // namespace esim::inline compose
