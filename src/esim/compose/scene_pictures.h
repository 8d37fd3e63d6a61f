#pragma once

#include <memory>

#include "esim/compose/compose.h"
#include "esim/preview/colours.h"

namespace esim::inline compose {

/// Images of a scenario's scene for display: from any pose, through any camera, at any time. The scene is loaded once.
/// Images are in colour if the renderer supports it.
class ScenePictures {
 public:
  /// Renders on `threads` threads (0: every processor).
  ScenePictures(const Scenario& scenario, int threads, const Notices& notices);

  const SceneFile& scene() const { return scene_; }
  const RendererTraits& traits() const { return traits_; }

  /// Renders the image of a camera at the poses and the time of `view`, whose tiles are ignored. Scenes deform from
  /// time 0 on, so that its time must count from the start of the body's trajectory if the scene deforms. Each pixel is
  /// the mean of finer x finer smaller ones; `finer` must be even in colour, so that each pixel covers all colour
  /// filters. Keeps the renderer for the next image of the same size. Call from one thread at a time.
  Image<Rgb> render(const Camera& camera, int finer, RenderRequest view);

 private:
  std::unique_ptr<Renderer> renderer_for(const Camera& camera) const;

  Workers workers_;
  SceneFile scene_;
  bool colour_ = true;
  RendererFactory factory_;
  RendererTraits traits_;
  std::unique_ptr<Renderer> renderer_;  // of the latest image
  Camera camera_;                       // of the latest image
};

/// The same view with width x height pixels.
Camera scaled(const Camera& camera, int width, int height);

}  // namespace esim::inline compose
