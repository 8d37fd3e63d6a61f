#include "esim/motion/online.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/error.h"
#include "esim/geometry/bspline.h"
#include "esim/geometry/so3.h"

namespace esim::inline motion {
namespace {

OnlineMotionOptions checked(const OnlineMotionOptions& options) {
  if (options.interval <= 0)
    throw UserError(fmt::format("online motion: interval is {} ns; it must be positive", options.interval));
  if (options.order != 4 && options.order != 6)
    throw UserError(fmt::format("online motion: order is {}; it must be 4 or 6", options.order));
  return options;
}

const SE3& checked(const SE3& pose) {
  if (!pose.translation.allFinite() || !(std::abs(pose.rotation.norm() - 1) < 1e-6))
    throw UserError("online motion: a pose is not finite, or its quaternion does not have unit norm");
  return pose;
}

}  // namespace

OnlineTrajectory::OnlineTrajectory(const OnlineMotionOptions& options, const SE3& T_world_body)
    : options_(checked(options)), controls_(static_cast<std::size_t>(options.order - 1), checked(T_world_body)) {}

void OnlineTrajectory::push(const SE3& T_world_body) {
  constexpr double kNearlyHalfTurn_rad = 0.999 * std::numbers::pi;
  const SE3& last = controls_.back();
  if (so3_log((last.rotation.conjugate() * checked(T_world_body).rotation).normalized()).norm() > kNearlyHalfTurn_rad)
    throw UserError("online motion: the body turns by 180 deg from one pushed pose to the next; push poses more often");
  velocity_ = (T_world_body.translation - last.translation) / to_seconds(options_.interval);
  controls_.push_back(T_world_body);
}

void OnlineTrajectory::push_motion(const Eigen::Vector3d& acceleration_world, const Eigen::Vector3d& omega_body) {
  const double h = to_seconds(options_.interval);
  const Eigen::Vector3d velocity = velocity_ + h * acceleration_world;
  const SE3& last = controls_.back();
  push({(last.rotation * so3_exp(h * omega_body)).normalized(),
        last.translation + h * velocity_ + h * h / 2 * acceleration_world});
  velocity_ = velocity;
}

TimeNs OnlineTrajectory::newest() const {
  const auto pushed = static_cast<TimeNs>(controls_.size()) - (options_.order - 1);
  return options_.start + latency() + pushed * options_.interval;
}

Kinematics OnlineTrajectory::at(TimeNs t) const {
  require_covered(t);
  // The segment (k, k + 1] · interval: the end of the known motion stays in the same segment after later pushes.
  const TimeNs since_start = t - options_.start;
  const TimeNs segment = since_start == 0 ? 0 : (since_start - 1) / options_.interval;
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Eigen::Vector3d> positions;
  for (int j = 0; j < options_.order; ++j) {
    const SE3& control = controls_[std::min(static_cast<std::size_t>(segment + j), controls_.size() - 1)];
    rotations.push_back(control.rotation);
    positions.push_back(control.translation);
  }
  const Se3Spline spline(options_.order, 0.0, to_seconds(options_.interval), std::move(rotations),
                         std::move(positions));
  const SplineValue value = spline.at(std::min(to_seconds(since_start - segment * options_.interval), spline.end_s()));
  return {value.pose, value.velocity, value.acceleration, value.angular_velocity, value.angular_acceleration};
}

}  // namespace esim::inline motion
