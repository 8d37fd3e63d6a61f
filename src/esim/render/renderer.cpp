#include "esim/render/renderer.h"

#include "esim/core/error.h"

namespace esim {

std::unique_ptr<Rendering> Renderer::start_together(std::vector<RenderRequest> requests) {
  if (requests.size() != 1) throw InternalError("renderer " + traits().name + ": it evaluates one request at a time");
  return start(std::move(requests[0]));
}

class ProcessorRenderer::Postponed final : public Rendering {
 public:
  Postponed(const ProcessorRenderer& renderer, std::vector<RenderRequest> requests)
      : renderer_(renderer), requests_(std::move(requests)) {}

  void finish(Sample& sample) override { renderer_.compute(requests_, sample); }

 private:
  const ProcessorRenderer& renderer_;
  std::vector<RenderRequest> requests_;
};

std::unique_ptr<Rendering> ProcessorRenderer::start(RenderRequest request) {
  std::vector<RenderRequest> requests;
  requests.push_back(std::move(request));
  return start_together(std::move(requests));
}

std::unique_ptr<Rendering> ProcessorRenderer::start_together(std::vector<RenderRequest> requests) {
  return std::make_unique<Postponed>(*this, std::move(requests));
}

}  // namespace esim
