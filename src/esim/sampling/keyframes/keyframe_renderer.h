#pragma once

#include <memory>

#include "esim/reproject/keyframe.h"
#include "esim/sampling/context.h"

namespace esim::inline sampling {

/// Renders the keyframes of one sampler. If the scene's renderer can average over the area of a sensor pixel, it
/// renders wide pixels, and narrow ones too if it can; otherwise only narrow ones. Only one rendering at a time may be
/// in progress, since it keeps the narrow pixels until take_light().
class KeyframeRenderer final : public Renderer {
 public:
  KeyframeRenderer(const KeyframeLayout& layout, const SceneAccess& scene);

  RendererTraits traits() const override;

  /// The request must be for the whole image.
  std::unique_ptr<Rendering> start(RenderRequest request) override;

  /// Takes the light of the rendering that has just filled `sample`.
  KeyframeLight take_light(Sample& sample);

 private:
  class InProgress;

  std::unique_ptr<Renderer> wide_, narrow_;  // one may be null
  Sample narrow_sample_;                     // if there are both
};

}  // namespace esim::inline sampling
