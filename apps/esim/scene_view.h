#pragma once

#include <vector>

#include "esim/compose/scene_pictures.h"

namespace esim::app {

/// What a scenario's renderer shows of its scene at the beginning, as pictures from wherever one likes, through the
/// scenario's first camera. In colour where the renderer has colours.
class SceneView {
 public:
  SceneView(const Scenario& scenario, int threads, const Notices& notices);

  /// Where the scenario's trajectory, which may be missing, or else the first camera of its scene file begins; without
  /// both, in front of the mesh, or at the origin. A camera's pose.
  const SE3& start() const { return start_; }

  const SE3& T_body_camera() const { return T_body_camera_; }

  /// As large as fits into so many pixels.
  Image<Rgb> look(const SE3& T_world_camera, int width, int height);

  /// As large as the camera's image.
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
