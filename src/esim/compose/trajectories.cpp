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

/// A duration is needed where the trajectory has no end of its own.
TimeNs span_needed(const Scenario& scenario) {
  if (!scenario.duration_s)
    throw UserError("duration_s: is missing; a random or static trajectory has no end of its own");
  return to_ns(scenario.start_s + *scenario.duration_s);
}

std::shared_ptr<const Trajectory> build(const FileTrajectoryOptions& options, const Scenario&, const Notices& notices) {
  if (options.path.empty()) throw UserError("trajectory.path: is missing; name a file of poses");
  std::vector<TimedPose> poses = read_trajectory(options.path);
  for (TimedPose& pose : poses) pose.t = std::llround(static_cast<double>(pose.t) * options.time_scale);
  try {
    const FittedTrajectory fitted =
        fit_trajectory(poses, {options.order, options.knot_interval_s, options.smoothing_time_s});
    const FitReport& fit = fitted.report;
    notices.note(
        fmt::format("trajectory: {} poses fitted by a spline with a knot every {:.1f} ms; residual {:.3f} mm rms "
                    "({:.3f} max), {:.4f} deg rms ({:.4f} max)",
                    poses.size(), fit.knot_interval_s * 1e3, fit.rms_position_m * 1e3, fit.max_position_m * 1e3,
                    fit.rms_rotation_rad / kDegree, fit.max_rotation_rad / kDegree));
    return std::make_shared<const SplineTrajectory>(fitted.trajectory);
  } catch (const UserError& error) {
    throw UserError(fmt::format("{}: {}", options.path.string(), error.what()));
  }
}

std::shared_ptr<const Trajectory> build(const RandomTrajectoryOptions& options, const Scenario& scenario,
                                        const Notices&) {
  RandomMotionOptions motion;
  motion.position_amplitude_m = options.position_amplitude_m;
  motion.rotation_amplitude_rad = options.rotation_amplitude_deg * kDegree;
  motion.knot_interval_s = options.knot_interval_s;
  motion.center = pose_of(options.center, looking_along(Eigen::Vector3d::UnitX()));
  motion.order = options.order;
  return std::make_shared<const SplineTrajectory>(random_trajectory(motion, 0, span_needed(scenario), scenario.seed));
}

std::shared_ptr<const Trajectory> build(const StaticTrajectoryOptions& options, const Scenario& scenario,
                                        const Notices&) {
  return std::make_shared<const StaticTrajectory>(pose_of(options.pose, looking_along(Eigen::Vector3d::UnitX())), 0,
                                                  span_needed(scenario));
}

}  // namespace

std::shared_ptr<const Trajectory> build_trajectory(const Scenario& scenario, const Notices& notices) {
  return std::visit([&](const auto& options) { return build(options, scenario, notices); }, scenario.trajectory);
}

}  // namespace esim
