#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/record/preview/colours.h"

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
  void make_factory(const Scenario& scenario, const Notices& notices);
  void find_start(const Scenario& scenario, const Notices& notices);
  std::unique_ptr<Renderer> renderer_for(const Camera& camera) const;
  Image<Rgb> render(Renderer& renderer, const Camera& camera, int finer, const SE3& T_world_camera) const;

  Workers workers_;
  Camera camera_;
  SE3 T_body_camera_, start_;
  SceneFile scene_;
  bool colour_ = true;
  RendererFactory factory_;
  TimeNs t_ = 0;                     // the beginning
  std::vector<Kinematics> objects_;  // at t_
  Camera view_camera_;               // of the latest look
  std::unique_ptr<Renderer> view_;
};

}  // namespace esim::app
