#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "render/scenes.h"
#include "unrealcv/shown.h"

namespace esim::test {

/// An `unrealcv` renderer with its server, which shows the images of the ray caster.
class ServedRenderer final : public Renderer {
 public:
  ServedRenderer(const std::string& scene, const Camera& camera, const Workers& workers)
      : names_(scene.starts_with("moving") ? std::vector<std::string>{"left", "right"} : std::vector<std::string>()),
        server_(show_with([scene](const Camera& model) { return make_renderer(scene, model); }, names_), names_) {
    UnrealcvOptions options = options_for(server_, 60);
    options.objects = names_;
    renderer_ = make_unrealcv_renderer(make_unrealcv_client(options), camera, workers);
  }

  RendererTraits traits() const override { return renderer_->traits(); }
  std::unique_ptr<Rendering> start(RenderRequest request) override { return renderer_->start(std::move(request)); }

 private:
  std::vector<std::string> names_;
  UnrealcvServer server_;
  std::unique_ptr<Renderer> renderer_;
};

/// The engines that make_any_renderer() makes.
inline constexpr std::array kEngines = {"unrealcv", "moving_unrealcv"};

/// make_renderer, also for engines.
inline std::unique_ptr<Renderer> make_any_renderer(const std::string& name, const Camera& camera,
                                                   const Workers& workers = two_threads()) {
  if (name == "unrealcv") return std::make_unique<ServedRenderer>("mesh", camera, workers);
  if (name == "moving_unrealcv") return std::make_unique<ServedRenderer>("moving_mesh", camera, workers);
  return make_renderer(name, camera, workers);
}

}  // namespace esim::test
