#include "esim/render/renderer.h"

namespace esim::inline render {
namespace {

/// Evaluations of disjoint tiles, in sequence.
class InTurn final : public Rendering {
 public:
  InTurn(Renderer& renderer, std::vector<RenderRequest> requests) : t_(requests[0].t) {
    for (RenderRequest& request : requests) {
      tiles_.insert(tiles_.end(), request.tiles.begin(), request.tiles.end());
      renderings_.push_back(renderer.start(std::move(request)));
    }
  }

  void finish(Sample& sample) override {
    for (const auto& rendering : renderings_) rendering->finish(sample);
    sample.t = t_;
    sample.tiles = tiles_;
  }

 private:
  TimeNs t_;
  std::vector<Tile> tiles_;
  std::vector<std::unique_ptr<Rendering>> renderings_;
};

}  // namespace

std::unique_ptr<Rendering> Renderer::start_together(std::vector<RenderRequest> requests) {
  if (requests.size() == 1) return start(std::move(requests[0]));
  return std::make_unique<InTurn>(*this, std::move(requests));
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

}  // namespace esim::inline render
