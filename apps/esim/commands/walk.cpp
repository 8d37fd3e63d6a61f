#include "commands/walk.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "esim/compose/waypoints.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/preview/pictures.h"
#include "esim/scenario/waypoint_file.h"
#include "support.h"

namespace esim::app {
namespace {

namespace fs = std::filesystem;
using Effect = Walker::Effect;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A text as YAML, in quotes if necessary.
std::string in_quotes(const std::string& text) {
  const bool plain = std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.' || c == '/';
  });
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

}  // namespace

WalkFile::WalkFile(const fs::path& path, bool append, bool force) : path_(path) {
  std::error_code error;
  const fs::path folder = fs::absolute(path).parent_path();
  if (!fs::is_directory(folder, error))
    throw UserError(fmt::format("--out {}: the folder {} does not exist; create it", path.string(), folder.string()));
  if (!fs::exists(path, error) || (force && !append)) return;
  if (!append) {
    throw UserError(
        fmt::format("--out {}: exists; continue it with --append, replace it with --force, or "
                    "name another file",
                    path.string()));
  }
  points_ = read_waypoints(path);
  for (const WaypointPointOptions& point : points_) {
    if (!point.t) continue;
    throw UserError(fmt::format("--out {}: its points have times, so that it cannot be continued; name another file",
                                path.string()));
  }
}

void WalkFile::add(const SE3& T_world_body) {
  static_cast<PoseOptions&>(points_.emplace_back()) = options_of(T_world_body);
  write();
}

void WalkFile::remove_last() {
  points_.pop_back();
  write();
}

void WalkFile::write() const {
  write_file_atomically(path_, "# Poses of the body: trajectory: {type: waypoints, file: " + path_.filename().string() +
                                   "}\n" + write_waypoints(points_));
}

Walk::Walk(WalkFile file, SceneView& view, const std::optional<Eigen::Vector3d>& start, double speed_m_per_s)
    : file_(std::move(file)), view_(view), walker_(start_at(start), speed_m_per_s) {
  for (const Waypoint& point : waypoints_of(file_.points(), view_.T_body_camera()))
    walker_.add_point(point.T_world_body * view_.T_body_camera());
}

SE3 Walk::start_at(const std::optional<Eigen::Vector3d>& position) const {
  if (position) return {view_.start().rotation, *position};
  if (file_.points().empty()) return view_.start();
  return waypoints_of(file_.points(), view_.T_body_camera()).back().T_world_body * view_.T_body_camera();
}

Effect Walk::press(Key key) {
  const Effect effect = walker_.press(key);
  switch (effect) {
    case Effect::dropped:
      file_.add(walker_.points().back() * view_.T_body_camera().inverse());
      message_ = fmt::format("waypoint {} saved to {}", file_.points().size(), file_.path().string());
      break;
    case Effect::removed:
      file_.remove_last();
      message_ = fmt::format("removed; {} left", file_.points().size());
      break;
    case Effect::stands_there:
      message_ = "the last waypoint is already here; move first";
      break;
    case Effect::nothing:
      message_ = "there is no waypoint yet";
      break;
    case Effect::preview:
      write_picture();
      break;
    default:
      message_.clear();
  }
  return effect;
}

std::string Walk::status() const {
  const Eigen::Vector3d p = T_world_camera().translation;
  return fmt::format("{:.2f} {:.2f} {:.2f} m  heading {:.0f}, up {:.0f} deg  {:.3g} m/s  {} waypoint{}", p.x(), p.y(),
                     p.z(), walker_.yaw_rad() / kDegree, walker_.pitch_rad() / kDegree, walker_.speed_m_per_s(),
                     file_.points().size(), file_.points().size() == 1 ? "" : "s");
}

WaypointTrajectory Walk::motion() const {
  WaypointTrajectoryOptions options;
  options.points = file_.points();
  options.points_file = file_.path();
  return waypoint_trajectory(options, view_.T_body_camera(), "");
}

SE3 Walk::T_world_camera(const WaypointTrajectory& motion, TimeNs t) const {
  return motion.at(t).T_world_body * view_.T_body_camera();
}

void Walk::print_summary(const fs::path& scenario) const {
  const std::size_t count = file_.points().size();
  if (count == 0) return;
  tell(stderr, "{}: {} waypoint{}\n", file_.path().string(), count, count == 1 ? "" : "s");
  if (count < 2) {
    tell(stderr, "a motion needs two waypoints; continue with --append\n");
    return;
  }
  const WaypointTrajectory whole = motion();
  const fs::path folder = fs::absolute(scenario).parent_path();
  tell(stderr, "in the scenario:\n");
  tell(stdout, "trajectory: {{type: waypoints, file: {}}}\nduration_s: {:.3f}\n",
       in_quotes(fs::absolute(file_.path()).lexically_proximate(folder).generic_string()),
       std::floor(to_seconds(whole.end()) * 1e3) / 1e3);
}

/// Writes the current view to a new .png file next to the file of waypoints.
void Walk::write_picture() {
  fs::path path;
  std::error_code error;
  for (int i = 1; path.empty() || fs::exists(path, error); ++i)
    path = fs::path(file_.path()).replace_extension(fmt::format(".{}.png", i));
  write_file_atomically(path, encode_png(view_.picture(T_world_camera())));
  message_ = fmt::format("picture: {}", path.string());
}

}  // namespace esim::app
