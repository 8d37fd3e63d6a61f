#pragma once

#include <string>
#include <vector>

#include "esim/motion/waypoints/waypoints.h"
#include "esim/scenario/scenario.h"

namespace esim::inline compose {

/// The poses of the body at a list of points; look_at aims the optical axis of the camera at T_body_camera. Throws
/// UserError with the point's index if an orientation is missing, given twice or zero, or if the camera cannot look at
/// the point.
std::vector<Waypoint> waypoints_of(const std::vector<WaypointPointOptions>& points, const SE3& T_body_camera);

/// The motion through these poses. The message of a UserError begins with `key`, or with the file of the points.
WaypointTrajectory waypoint_trajectory(const WaypointTrajectoryOptions& options, const SE3& T_body_camera,
                                       const std::string& key);

}  // namespace esim::inline compose
