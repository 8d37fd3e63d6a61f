#include "esim/sampling/keyframes/keyframe_renderer.h"

#include <utility>

namespace esim::inline sampling {

/// A rendering of wide and narrow pixels.
class KeyframeRenderer::InProgress final : public Rendering {
 public:
  InProgress(KeyframeRenderer& renderer, RenderRequest request) : narrow_sample_(renderer.narrow_sample_) {
    wide_ = renderer.wide_->start(request);
    request.motion_rows = request.tiles.front().height;  // the wide pixels have the motion field
    narrow_ = renderer.narrow_->start(std::move(request));
  }

  void finish(Sample& sample) override {
    wide_->finish(sample);
    narrow_->finish(narrow_sample_);
  }

 private:
  Sample& narrow_sample_;
  std::unique_ptr<Rendering> wide_, narrow_;
};

KeyframeRenderer::KeyframeRenderer(const KeyframeLayout& layout, const SceneAccess& scene) {
  const double s = layout.supersampling;
  wide_ = scene.make_renderer(layout.camera, PixelArea{s, s});
  if (wide_ == nullptr) {
    narrow_ = scene.make_renderer(layout.camera, std::nullopt);
  } else if (s > 1 && wide_->traits().has_edges) {
    narrow_ = scene.make_renderer(layout.camera, PixelArea{1, 1});
  }
}

RendererTraits KeyframeRenderer::traits() const { return (wide_ != nullptr ? wide_ : narrow_)->traits(); }

std::unique_ptr<Rendering> KeyframeRenderer::start(RenderRequest request) {
  if (wide_ == nullptr) return narrow_->start(std::move(request));
  if (narrow_ == nullptr) return wide_->start(std::move(request));
  return std::make_unique<InProgress>(*this, std::move(request));
}

KeyframeLight KeyframeRenderer::take_light(Sample& sample) {
  KeyframeLight light;
  (wide_ != nullptr ? light.wide : light.narrow) = std::exchange(sample.irradiance, {});
  if (wide_ != nullptr && narrow_ != nullptr) light.narrow = std::exchange(narrow_sample_.irradiance, {});
  return light;
}

}  // namespace esim::inline sampling
