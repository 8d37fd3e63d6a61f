#include <fmt/format.h>

#include <numbers>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/motion/fit.h"
#include "esim/motion/random.h"
#include "esim/motion/static.h"
#include "esim/motion/trajectory_file.h"

namespace esim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Whose motion is built, and what it has to cover where its options do not say.
struct Mover {
  std::string key;                                                  ///< of its options, for messages
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< where its options give none
  std::uint64_t seed = 0;
  std::uint16_t stream = 0;  ///< of random numbers
  std::function<TimeSpan()> span;
};

std::shared_ptr<const Trajectory> build(const FileTrajectoryOptions& options, const Mover& mover,
                                        const Notices& notices) {
  if (options.path.empty()) throw UserError(fmt::format("{}.path: is missing; name a file of poses", mover.key));
  std::vector<TimedPose> poses = read_trajectory(options.path);
  for (TimedPose& pose : poses) pose.t = std::llround(static_cast<double>(pose.t) * options.time_scale);
  try {
    const FittedTrajectory fitted =
        fit_trajectory(poses, {options.order, options.knot_interval_s, options.smoothing_time_s});
    const FitReport& fit = fitted.report;
    notices.note(
        fmt::format("{}: {} poses fitted by a spline with a knot every {:.1f} ms; residual {:.3f} mm rms "
                    "({:.3f} max), {:.4f} deg rms ({:.4f} max)",
                    mover.key, poses.size(), fit.knot_interval_s * 1e3, fit.rms_position_m * 1e3,
                    fit.max_position_m * 1e3, fit.rms_rotation_rad / kDegree, fit.max_rotation_rad / kDegree));
    return std::make_shared<const SplineTrajectory>(fitted.trajectory);
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

std::shared_ptr<const Trajectory> build(const TrajectoryOptions& options, const Mover& mover, const Notices& notices) {
  return std::visit([&](const auto& alternative) { return build(alternative, mover, notices); }, options);
}

}  // namespace

std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const Notices& notices) {
  const auto span = [&]() -> TimeSpan {
    if (!scenario.duration_s)
      throw UserError("duration_s: is missing; a random or static trajectory has no end of its own");
    return {0, to_ns(scenario.start_s + *scenario.duration_s)};
  };
  return build(scenario.trajectory, {"trajectory", looking_along(Eigen::Vector3d::UnitX()), scenario.seed, 0, span},
               notices);
}

std::vector<std::shared_ptr<const Trajectory>> build_object_trajectories(const Scenario& scenario,
                                                                         const Trajectory& body,
                                                                         const TimeSpan& simulated,
                                                                         const Notices& notices) {
  std::vector<std::shared_ptr<const Trajectory>> trajectories;
  const auto* const mesh = std::get_if<MeshRendererOptions>(&scenario.renderer);
  if (mesh == nullptr) return trajectories;
  const auto span = [&]() -> TimeSpan { return {body.start(), simulated.end}; };
  for (const ObjectOptions& object : mesh->objects) {
    const std::string key = fmt::format("renderer.objects.{}.trajectory", trajectories.size());
    const auto stream = static_cast<std::uint16_t>(trajectories.size() + 1);
    auto trajectory =
        build(object.trajectory, {key, Eigen::Quaterniond::Identity(), scenario.seed, stream, span}, notices);
    if (trajectory->start() > simulated.start || trajectory->end() < simulated.end) {
      throw UserError(
          fmt::format("{}: lasts from {:.9g} to {:.9g} s, but the simulation from {:.9g} to {:.9g} s; shorten "
                      "the simulation with start_s and duration_s, or stretch the trajectory with its time_scale",
                      key, to_seconds(trajectory->start()), to_seconds(trajectory->end()), to_seconds(simulated.start),
                      to_seconds(simulated.end)));
    }
    trajectories.push_back(std::move(trajectory));
  }
  return trajectories;
}

}  // namespace esim
