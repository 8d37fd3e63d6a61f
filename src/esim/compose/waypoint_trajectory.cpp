#include "esim/compose/waypoint_trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/error.h"

namespace esim::inline compose {
namespace {

/// The orientation of a body at `position` so that its camera, at T_body_camera, has `target` on its optical axis, its
/// x axis perpendicular to `up`, and its y axis pointing away from `up`.
Eigen::Quaterniond aim(const Eigen::Vector3d& position, const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                       const SE3& T_body_camera) {
  const Eigen::Vector3d to_target = target - position;
  const double distance = to_target.norm();
  if (!(distance > 1e-9)) throw UserError("look_at must differ from position; choose another point");
  if (!(up.norm() > 1e-9)) throw UserError("up must not be [0, 0, 0]; use [0, 0, 1]");

  // The vector from the body's origin to the target in camera axes: the target lies on the camera's z axis.
  const Eigen::Vector3d camera_in_camera_axes = T_body_camera.rotation.conjugate() * T_body_camera.translation;
  const double lateral = camera_in_camera_axes.head<2>().norm();
  if (!(lateral < distance)) {
    throw UserError(fmt::format(
        "look_at is {:.3g} m from the body, but must be further away than the camera's lateral offset, {:.3g} m; "
        "choose a point further away",
        distance, lateral));
  }
  const Eigen::Vector3d seen(camera_in_camera_axes.x(), camera_in_camera_axes.y(),
                             std::sqrt(distance * distance - lateral * lateral));

  // First any rotation of `seen` to the target, then a rotation about the line to it by the angle θ at which the
  // camera's x axis is level: a cos θ + b sin θ + c = 0.
  const Eigen::Quaterniond some = Eigen::Quaterniond::FromTwoVectors(seen, to_target);
  const Eigen::Vector3d axis = to_target / distance, vertical = up.normalized(), x = some * Eigen::Vector3d::UnitX();
  const double c = axis.dot(x) * axis.dot(vertical), a = x.dot(vertical) - c, b = axis.cross(x).dot(vertical);
  const double amplitude = std::hypot(a, b);
  if (!(amplitude > 1e-6 && std::abs(c) < amplitude))
    throw UserError(
        "up must not point along the optical axis, since the image's rotation would be undefined; choose another up");
  const double middle = std::atan2(b, a), half = std::acos(-c / amplitude);
  const auto turned_by = [&](double angle) { return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)) * some; };
  const Eigen::Quaterniond one = turned_by(middle + half), other = turned_by(middle - half);
  const auto downwards = [&](const Eigen::Quaterniond& R) { return -(R * Eigen::Vector3d::UnitY()).dot(vertical); };
  const Eigen::Quaterniond& camera = downwards(one) > downwards(other) ? one : other;
  return (camera * T_body_camera.rotation.conjugate()).normalized();
}

SE3 pose_at(const WaypointPointOptions& point, const SE3& T_body_camera) {
  if (!point.quaternion && !point.look_at) throw UserError("has no orientation; give a quaternion or look_at");
  if (point.up && !point.look_at) throw UserError("up has no effect without look_at; remove it");
  SE3 pose = pose_of(point);
  if (point.look_at) {
    pose.rotation = aim(point.position, *point.look_at, point.up.value_or(Eigen::Vector3d::UnitZ()), T_body_camera);
  }
  return pose;
}

}  // namespace

std::vector<Waypoint> waypoints_of(const std::vector<WaypointPointOptions>& points, const SE3& T_body_camera) {
  std::vector<Waypoint> waypoints;
  for (const WaypointPointOptions& point : points) {
    try {
      waypoints.push_back({pose_at(point, T_body_camera), point.t, point.speed, point.pause_s.value_or(0.0)});
    } catch (const UserError& error) {
      throw UserError(fmt::format("points.{}: {}", waypoints.size(), error.what()));
    }
  }
  return waypoints;
}

WaypointTrajectory waypoint_trajectory(const WaypointTrajectoryOptions& options, const SE3& T_body_camera,
                                       const std::string& key) {
  WaypointOptions motion;
  motion.speed_m_per_s = options.speed;
  motion.turn_rad_per_s = options.turn_deg_per_s * std::numbers::pi / 180.0;
  motion.ramp_s = options.ramp_s;
  motion.rest = options.rest;
  motion.closed = options.closed;
  try {
    return {waypoints_of(options.points, T_body_camera), motion};
  } catch (const UserError& error) {
    throw UserError(
        fmt::format("{}: {}", options.points_file.empty() ? key : options.points_file.string(), error.what()));
  }
}

}  // namespace esim::inline compose
