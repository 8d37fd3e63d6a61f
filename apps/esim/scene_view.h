#pragma once

#include <vector>

#include "esim/compose/scene_pictures.h"

namespace esim::app {

/// Images of a scenario's scene at its start time, from any pose, through the scenario's first camera. In colour if the
/// renderer supports it.
class SceneView {
 public:
  SceneView(const Scenario& scenario, int threads, const Notices& notices);

  /// The initial pose of the camera: the start of the scenario's trajectory; without one, of the first camera of the
  /// scene file; otherwise in front of the mesh, or at the origin.
  const SE3& start() const { return start_; }

  const SE3& T_body_camera() const { return T_body_camera_; }

  /// An image as large as fits into width x height pixels.
  Image<Rgb> look(const SE3& T_world_camera, int width, int height);

  /// An image of the camera's size.
  Image<Rgb> picture(const SE3& T_world_camera);

 private:
  void find_start(const Scenario& scenario, const Notices& notices);
  RenderRequest seen_from(const SE3& T_world_camera) const;

  ScenePictures pictures_;
  Camera camera_;
  SE3 T_body_camera_, start_;
  TimeNs t_ = 0;                     // the beginning
  std::vector<Kinematics> objects_;  // at t_
};

}  // namespace esim::app
