#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/motion/waypoints/waypoints.h"
#include "esim/walk/walker.h"
#include "scene_view.h"

namespace esim::app {

/// The points of a walk and their file, which is written after every change.
class WalkFile {
 public:
  /// Throws UserError if the file exists and neither `append` nor `force` is set, or if it cannot be continued.
  WalkFile(const std::filesystem::path& path, bool append, bool force);

  void add(const SE3& T_world_body);
  void remove_last();

  const std::filesystem::path& path() const { return path_; }
  const std::vector<WaypointPointOptions>& points() const { return points_; }

 private:
  void write() const;

  std::filesystem::path path_;
  std::vector<WaypointPointOptions> points_;
};

/// A walk from the first key to the last.
class Walk {
 public:
  /// Begins at `start`, a position of the camera; if not given, at the last point of the file or at the view's start.
  Walk(WalkFile file, SceneView& view, const std::optional<Eigen::Vector3d>& start, double speed_m_per_s);

  /// Executes a key, except playing, help and leaving, which the caller does.
  Walker::Effect press(Key key);

  SE3 T_world_camera() const { return walker_.T_world_camera(); }
  Image<Rgb> look(const SE3& T_world_camera, int width, int height) {
    return view_.look(T_world_camera, width, height);
  }

  /// The result of the last key as text.
  const std::string& message() const { return message_; }
  void say(const std::string& message) { message_ = message; }

  /// The current pose, in one line.
  std::string status() const;

  /// The motion through the points so far. Throws UserError if it is undefined.
  WaypointTrajectory motion() const;
  SE3 T_world_camera(const WaypointTrajectory& motion, TimeNs t) const;

  /// Prints how to use the file; the lines for the scenario go to standard output.
  void print_summary(const std::filesystem::path& scenario) const;

 private:
  SE3 start_at(const std::optional<Eigen::Vector3d>& position) const;
  void write_picture();

  WalkFile file_;
  SceneView& view_;
  Walker walker_;
  std::string message_;
};

}  // namespace esim::app
