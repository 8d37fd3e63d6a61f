#pragma once

#include <memory>

#include "esim/compose/compose.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// What a scenario's renderer shows, loaded once, as pictures for people: from wherever one likes, through any camera,
/// at any time. In colour where the renderer has colours.
class ScenePictures {
 public:
  /// Renders on `threads` threads (0: every processor).
  ScenePictures(const Scenario& scenario, int threads, const Notices& notices);

  const SceneFile& scene() const { return scene_; }
  const RendererTraits& traits() const { return traits_; }

  /// What `view` sees (of its poses and its time; its tiles do not matter) through a camera, each pixel the mean of
  /// finer x finer smaller ones. `finer` is even where there are colours, so that each sees them all. The renderer is
  /// kept for the next picture of the same size. From one thread at a time.
  Image<Rgb> render(const Camera& camera, int finer, RenderRequest view);

 private:
  std::unique_ptr<Renderer> renderer_for(const Camera& camera) const;

  Workers workers_;
  SceneFile scene_;
  bool colour_ = true;
  RendererFactory factory_;
  RendererTraits traits_;
  std::unique_ptr<Renderer> renderer_;  // of the latest picture
  Camera camera_;                       // of it
};

/// The same view in so many pixels.
Camera scaled(const Camera& camera, int width, int height);

/// Before the meshes, so far that all of them are in view, looking along world x; at the origin where there are none.
SE3 before_the_meshes(const Scene& scene, const Camera& camera);

}  // namespace esim
