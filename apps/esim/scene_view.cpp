#include "scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"
#include "esim/motion/static.h"
#include "esim/scenario/read.h"

namespace esim::app {
namespace {

// Each pixel of an image is the mean of a square of this side; it must be even, to cover all filters of the Bayer
// pattern. Larger squares reduce colour fringes at edges.
constexpr int kFinerLook = 4, kFinerPicture = 2;

/// Whether the scenario has a motion that gives the initial pose.
bool has_trajectory(const Scenario& scenario) {
  if (const auto* const file = std::get_if<FileTrajectoryOptions>(&scenario.trajectory)) return !file->path.empty();
  if (const auto* const points = std::get_if<WaypointTrajectoryOptions>(&scenario.trajectory))
    return points->points.size() >= 2;
  return true;
}

}  // namespace

SceneView::SceneView(const Scenario& scenario, int threads, const Notices& notices)
    : pictures_(scenario, threads, notices) {
  const CameraOptions& options = scenario.cameras.front();
  camera_ = camera_model(options);
  T_body_camera_ = pose_named("T_body_camera", options.T_body_camera);
  if (pictures_.traits().on_sensor) {
    throw UserError(
        fmt::format("renderer: {} are drawn on the sensor, so that there is no 3D scene to walk through; use a mesh, a "
                    "plane or a panorama",
                    pictures_.traits().name));
  }
  find_start(scenario, notices);

  const StaticTrajectory body(start_, t_, kNsPerMs);
  for (const auto& object : build_object_trajectories(scenario, pictures_.scene(), body, {t_, t_ + kNsPerMs}, notices))
    objects_.push_back(object->at(t_));
}

void SceneView::find_start(const Scenario& scenario, const Notices& notices) {
  const SceneFile& scene = pictures_.scene();
  if (has_trajectory(scenario)) {
    Scenario with_end = scenario;
    if (!with_end.duration_s) with_end.duration_s = 1;  // for trajectories that do not define one
    const auto trajectory = build_trajectory(with_end, scene, notices);
    t_ = std::min(trajectory->start() + to_ns(scenario.start_s), trajectory->end());
    start_ = trajectory->at(t_).T_world_body * T_body_camera_;
  } else if (!scene.cameras.empty()) {
    start_ = scene.cameras.front().motion.front().T_world_object;
  } else {
    start_ = before_the_meshes(scene.scene, camera_);
  }
}

Image<Rgb> SceneView::look(const SE3& T_world_camera, int width, int height) {
  const double scale =
      std::min(static_cast<double>(width) / camera_.width, static_cast<double>(height) / camera_.height);
  const int columns = std::clamp(static_cast<int>(std::lround(scale * camera_.width)), 1, std::max(1, width)),
            rows = std::clamp(static_cast<int>(std::lround(scale * camera_.height)), 1, std::max(1, height));
  return pictures_.render(scaled(camera_, columns, rows), kFinerLook, seen_from(T_world_camera));
}

Image<Rgb> SceneView::picture(const SE3& T_world_camera) {
  return pictures_.render(camera_, kFinerPicture, seen_from(T_world_camera));
}

RenderRequest SceneView::seen_from(const SE3& T_world_camera) const {
  RenderRequest request;
  request.t = t_;
  request.camera.T_world_body = T_world_camera;
  request.objects = objects_;
  return request;
}

}  // namespace esim::app
