#pragma once

#include <string>
#include <vector>

#include "esim/motion/waypoints.h"
#include "esim/scenario/scenario.h"

namespace esim {

/// The poses of the body at a list of points, where look_at aims the optical axis of a camera at T_body_camera. Throws
/// UserError naming the point for orientations that are missing, given twice or zero, and for points that cannot be
/// looked at.
std::vector<Waypoint> waypoints_of(const std::vector<WaypointPointOptions>& points, const SE3& T_body_camera);

/// The motion through them. Throws UserError that begins with `key`, or with the file that the points come from.
WaypointTrajectory waypoint_trajectory(const WaypointTrajectoryOptions& options, const SE3& T_body_camera,
                                       const std::string& key);

}  // namespace esim
