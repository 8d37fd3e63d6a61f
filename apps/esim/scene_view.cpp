#include "scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"
#include "esim/motion/static.h"
#include "esim/scenario/read.h"

namespace esim::app {
namespace {

// The side of the square of pixels whose mean a pixel of a picture is; even, so that it sees every colour behind
// Bayer's filters. These lie side by side, which shows at edges the less, the finer they are.
constexpr int kFinerLook = 4, kFinerPicture = 2;

/// The same view in so many pixels.
Camera scaled(const Camera& camera, int width, int height) {
  const double x = static_cast<double>(width) / camera.width, y = static_cast<double>(height) / camera.height;
  Camera result = camera;
  result.width = width, result.height = height;
  result.fx *= x, result.fy *= y;
  result.cx = (camera.cx + 0.5) * x - 0.5;
  result.cy = (camera.cy + 0.5) * y - 0.5;
  return result;
}

/// Before a mesh, so far that all of it is in view, looking along world x.
SE3 before_the_mesh(const Scene& scene, double fov_rad) {
  Eigen::AlignedBox3d box;
  for (const SceneObject& object : scene.objects) {
    for (const Eigen::Vector3f& vertex : object.mesh.vertices) box.extend(vertex.cast<double>());
  }
  SE3 pose{looking_along(Eigen::Vector3d::UnitX()), Eigen::Vector3d::Zero()};
  if (box.isEmpty()) return pose;
  const double radius = 0.5 * box.diagonal().norm();
  pose.translation = box.center() - radius / std::sin(0.5 * std::min(fov_rad, 1.5)) * Eigen::Vector3d::UnitX();
  return pose;
}

/// Whether there is a motion to begin with.
bool has_trajectory(const Scenario& scenario) {
  if (const auto* const file = std::get_if<FileTrajectoryOptions>(&scenario.trajectory)) return !file->path.empty();
  if (const auto* const points = std::get_if<WaypointTrajectoryOptions>(&scenario.trajectory))
    return points->points.size() >= 2;
  return true;
}

}  // namespace

SceneView::SceneView(const Scenario& scenario, int threads, const Notices& notices) : workers_(threads) {
  const CameraOptions& options = scenario.cameras.front();
  camera_ = camera_model(options);
  T_body_camera_ = pose_named("T_body_camera", options.T_body_camera);
  make_factory(scenario, notices);
  find_start(scenario, notices);

  const StaticTrajectory body(start_, t_, kNsPerMs);
  for (const auto& object : build_object_trajectories(scenario, scene_, body, {t_, t_ + kNsPerMs}, notices))
    objects_.push_back(object->at(t_));
}

void SceneView::make_factory(const Scenario& scenario, const Notices& notices) {
  for (const bool colour : {true, false}) {
    try {
      colour_ = colour;
      scene_ = load_scenes(scenario.renderer, colour, notices);
      factory_ = build_renderer_factory(scenario.renderer, scene_, colour,
                                        {{scenario.cameras.front().name, camera_, T_body_camera_}}, notices);
      const RendererTraits traits = renderer_for(camera_)->traits();
      if (traits.on_sensor) {
        throw UserError(
            fmt::format("renderer: {} are drawn on the sensor itself; there is no space to walk through", traits.name));
      }
      return;
    } catch (const UserError&) {
      if (!colour) throw;
    }
  }
}

void SceneView::find_start(const Scenario& scenario, const Notices& notices) {
  if (has_trajectory(scenario)) {
    Scenario with_end = scenario;
    if (!with_end.duration_s) with_end.duration_s = 1;  // of those without an end of their own
    const auto trajectory = build_trajectory(with_end, scene_, notices);
    t_ = std::min(trajectory->start() + to_ns(scenario.start_s), trajectory->end());
    start_ = trajectory->at(t_).T_world_body * T_body_camera_;
  } else if (!scene_.cameras.empty()) {
    start_ = scene_.cameras.front().motion.front().T_world_object;
  } else {
    start_ = before_the_mesh(scene_.scene, 2 * std::atan(0.5 * camera_.width / camera_.fx));
  }
}

std::unique_ptr<Renderer> SceneView::renderer_for(const Camera& camera) const {
  return factory_(camera, colour_ ? ColourFilters::rggb : ColourFilters::none, workers_);
}

Image<Rgb> SceneView::render(Renderer& renderer, const Camera& camera, int finer, const SE3& T_world_camera) const {
  RenderRequest request;
  request.t = t_;
  request.camera.T_world_body = T_world_camera;
  request.tiles = {{0, 0, camera.width, camera.height}};
  request.objects = objects_;
  Sample sample;
  renderer.render(std::move(request), sample);

  // The mean of what each colour's pixels see, or of all.
  PerColour<Image<float>> light;
  for (auto& channel : light) channel = Image<float>(camera.width / finer, camera.height / finer);
  const auto pixels = static_cast<float>(finer * finer);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const float e = sample.irradiance(x, y);
      const std::size_t c = colour_at(x, y);
      for (std::size_t channel = 0; channel < light.size(); ++channel) {
        const float weight = colour_ ? (channel == c ? (c == 1 ? 2.0F : 4.0F) : 0.0F) : 1.0F;
        light[channel](x / finer, y / finer) += weight / pixels * e;
      }
    }
  }
  Image<Rgb> picture = grey(light[0]);
  const Image<Rgb> green = grey(light[1]), blue = grey(light[2]);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    picture.pixels()[i].g = green.pixels()[i].g;
    picture.pixels()[i].b = blue.pixels()[i].b;
  }
  return picture;
}

Image<Rgb> SceneView::look(const SE3& T_world_camera, int width, int height) {
  const double scale =
      std::min(static_cast<double>(width) / camera_.width, static_cast<double>(height) / camera_.height);
  const int columns = std::clamp(static_cast<int>(std::lround(scale * camera_.width)), 1, std::max(1, width)),
            rows = std::clamp(static_cast<int>(std::lround(scale * camera_.height)), 1, std::max(1, height));
  if (view_ == nullptr || view_camera_.width != kFinerLook * columns || view_camera_.height != kFinerLook * rows) {
    view_camera_ = scaled(camera_, kFinerLook * columns, kFinerLook * rows);
    view_ = renderer_for(view_camera_);
  }
  return render(*view_, view_camera_, kFinerLook, T_world_camera);
}

Image<Rgb> SceneView::picture(const SE3& T_world_camera) {
  const Camera fine = scaled(camera_, kFinerPicture * camera_.width, kFinerPicture * camera_.height);
  return render(*renderer_for(fine), fine, kFinerPicture, T_world_camera);
}

}  // namespace esim::app
