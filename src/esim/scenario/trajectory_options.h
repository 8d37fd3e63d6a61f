#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/describe.h"
#include "esim/scenario/pose_options.h"

/// The motions of the body and of objects. A new one is a struct with its describe(), an alternative of the variant at
/// the end, and a function in compose/build_trajectories.cpp. kHasDuration: whether the options alone define how long
/// the motion lasts; otherwise the scenario's duration_s does.
namespace esim::inline scenario {

/// A spline through the poses of a file.
struct FileTrajectoryOptions {
  static constexpr const char* kType = "file";
  static constexpr bool kHasDuration = true;
  std::filesystem::path path;
  std::optional<double> rate_hz;
  double scale = 1.0;
  std::optional<Eigen::Vector3d> up;
  double time_scale = 1.0;
  int order = 5;
  double knot_interval_s = 0.0;
  double smoothing_time_s = 0.0;
};

template <class Visitor>
void describe(Visitor& visit, FileTrajectoryOptions& o) {
  visit("path", o.path,
        About{"poses: TUM text (s), CSV (ns), a COLMAP model (folder or images file) or a transforms.json"});
  visit("rate_hz", o.rate_hz,
        About{"images per second, for poses of images without stamps (default: 30)", "Hz", 0, 1e6, true});
  visit("scale", o.scale, About{"factor that converts the file's positions to metres", "", 0, 1e6, true});
  visit("up", o.up,
        About{"direction in the file's coordinates that becomes z, by the smallest rotation (default: same axes)"});
  visit("time_scale", o.time_scale, About{"factor on the duration: 2 takes twice as long", "", 0, 1e6, true});
  visit("order", o.order, About{"order of the fitted spline: 4 (cubic) to 6", "", 4, 6});
  visit("knot_interval_s", o.knot_interval_s,
        About{"time between the spline's control points; 0: derived from the data", "s", 0, 1e6});
  visit("smoothing_time_s", o.smoothing_time_s,
        About{"time constant of the smoothing, which removes faster motion; 0: no smoothing", "s", 0, 1e6});
}

/// Smooth random motion around a pose.
struct RandomTrajectoryOptions {
  static constexpr const char* kType = "random";
  static constexpr bool kHasDuration = false;
  Eigen::Vector3d position_amplitude_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_amplitude_deg = Eigen::Vector3d::Zero();
  double knot_interval_s = 0.25;
  PoseOptions center;
  int order = 5;
};

template <class Visitor>
void describe(Visitor& visit, RandomTrajectoryOptions& o) {
  visit("position_amplitude_m", o.position_amplitude_m,
        About{"maximum translation along the axes x y z of center", "m", 0, 1e6});
  visit("rotation_amplitude_deg", o.rotation_amplitude_deg,
        About{"maximum rotation about the axes x y z of center (for a camera: pitch, yaw, roll)", "deg", 0, 36000});
  visit("knot_interval_s", o.knot_interval_s,
        About{"time between random poses; a smaller value makes the motion faster", "s", 0, 1e6, true});
  visit("center", o.center, About{"mean pose; without an orientation, a body looks along world x"});
  visit("order", o.order, About{"order of the spline: 4 (cubic) to 6", "", 4, 6});
}

/// No motion.
struct StaticTrajectoryOptions {
  static constexpr const char* kType = "static";
  static constexpr bool kHasDuration = false;
  PoseOptions pose;
};

template <class Visitor>
void describe(Visitor& visit, StaticTrajectoryOptions& o) {
  visit("pose", o.pose, About{"the constant pose; without an orientation, a body looks along world x"});
}

/// The motion of a camera in the renderer's scene file.
struct SceneTrajectoryOptions {
  static constexpr const char* kType = "scene";
  static constexpr bool kHasDuration = false;
  std::string camera;
};

template <class Visitor>
void describe(Visitor& visit, SceneTrajectoryOptions& o) {
  visit("camera", o.camera,
        About{"camera of the renderer's scene file that gives the motion and the field of view (default: the only "
              "camera)"});
}

/// A pose that the body passes through, and when or how.
struct WaypointPointOptions : PoseOptions {
  std::optional<Eigen::Vector3d> up;
  std::optional<double> t, speed, pause_s;
};

template <class Visitor>
void describe(Visitor& visit, WaypointPointOptions& o) {
  visit("position", o.position, About{"position of the body", "m", -1e6, 1e6});
  visit("quaternion", o.quaternion, About{"orientation of the body, Hamilton quaternion x y z w"});
  visit("look_at", o.look_at,
        About{"instead of quaternion: a point on the optical axis of the first camera (for an object: on its z axis)",
              "m", -1e6, 1e6});
  visit("up", o.up, About{"with look_at: the direction that points upwards in the image (default: world z)"});
  visit("t", o.t,
        About{"time at which the body reaches the point; give it for all points or for none", "s", -1e8, 1e8});
  visit("speed", o.speed,
        About{"speed on the way to the next point, if the points have no times (default: the speed of the trajectory)",
              "m/s", 0, 1e6, true});
  visit("pause_s", o.pause_s, About{"time for which the body stands still at the point (default: 0)", "s", 0, 1e8});
}

/// A path through poses. If `file` is given, the points come from there.
struct WaypointTrajectoryOptions {
  static constexpr const char* kType = "waypoints";
  static constexpr bool kHasDuration = true;
  std::filesystem::path file;
  std::vector<WaypointPointOptions> points;
  double speed = 1.0;
  double turn_deg_per_s = 45.0;
  double ramp_s = 0.5;
  bool rest = true;
  bool closed = false;

  /// The file that the points were read from, for messages; empty if the scenario lists them.
  std::filesystem::path points_file;
};

template <class Visitor>
void describe(Visitor& visit, WaypointTrajectoryOptions& o) {
  visit("file", o.file, About{"instead of points: a YAML file with such a list under points:"});
  visit("points", o.points, About{"two or more waypoints, visited in this order: a list of maps of"});
  visit("speed", o.speed, About{"speed along the path, if the points have no times", "m/s", 0, 1e6, true});
  visit("turn_deg_per_s", o.turn_deg_per_s,
        About{"if the points have no times: turning rate on the spot, and maximum mean turning rate between two points",
              "deg/s", 0, 1e6, true});
  visit("ramp_s", o.ramp_s,
        About{"time to accelerate after standing still, and to brake before it", "s", 0, 1e6, true});
  visit("rest", o.rest, About{"whether the body stands still at the start and at the end"});
  visit("closed", o.closed, About{"whether the path returns to the first point; only if the points have no times"});
}

using TrajectoryOptions = std::variant<FileTrajectoryOptions, RandomTrajectoryOptions, StaticTrajectoryOptions,
                                       SceneTrajectoryOptions, WaypointTrajectoryOptions>;

}  // namespace esim::inline scenario
