#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "esim/motion/waypoints.h"
#include "esim/walk/walker.h"
#include "scene_view.h"

namespace esim::app {

/// The points of a walk and the file that holds them, which is written with every change.
class WalkFile {
 public:
  /// Throws UserError where the file is there already, unless it is to be continued or replaced, and where it cannot
  /// be continued.
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

/// The walk from its first key to its last.
class Walk {
 public:
  /// Begins at `start`, the camera's position; or else where the file ends, or where the view begins.
  Walk(WalkFile file, SceneView& view, const std::optional<Eigen::Vector3d>& start, double speed_m_per_s);

  /// Does what the key asks for, but playing, helping and leaving.
  Walker::Effect press(Key key);

  SE3 T_world_camera() const { return walker_.T_world_camera(); }
  Image<Rgb> look(const SE3& T_world_camera, int width, int height) {
    return view_.look(T_world_camera, width, height);
  }

  /// What the last key has led to, for a person.
  const std::string& message() const { return message_; }
  void say(const std::string& message) { message_ = message; }

  /// Where one is, in a line.
  std::string status() const;

  /// The motion through the points so far. Throws UserError where there is none.
  WaypointTrajectory motion() const;
  SE3 T_world_camera(const WaypointTrajectory& motion, TimeNs t) const;

  /// Prints what to do with the file; to standard output what belongs into the scenario.
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
