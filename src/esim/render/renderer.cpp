#include "esim/render/renderer.h"

namespace esim {

class ProcessorRenderer::Postponed final : public Rendering {
 public:
  Postponed(const ProcessorRenderer& renderer, RenderRequest request)
      : renderer_(renderer), request_(std::move(request)) {}

  void finish(Sample& sample) override { renderer_.compute(request_, sample); }

 private:
  const ProcessorRenderer& renderer_;
  RenderRequest request_;
};

std::unique_ptr<Rendering> ProcessorRenderer::start(RenderRequest request) {
  return std::make_unique<Postponed>(*this, std::move(request));
}

}  // namespace esim
