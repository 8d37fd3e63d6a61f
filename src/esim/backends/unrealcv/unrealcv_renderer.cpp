#include "esim/backends/unrealcv/unrealcv_renderer.h"

#include <utility>

#include "esim/backends/unrealcv/client.h"
#include "esim/core/error.h"
#include "esim/render/bands.h"

namespace esim::inline backends::inline unrealcv {
namespace {

PinholeView require_pinhole(const Camera& camera, const PixelRays& rays, const std::string& name) {
  try {
    return pinhole_view(camera, rays, Pinhole::centred);
  } catch (const UserError& error) {
    throw UserError(name + ": " + error.what() + "; use a camera with a narrower field of view");
  }
}

class UnrealcvRenderer final : public Renderer {
 public:
  UnrealcvRenderer(std::shared_ptr<UnrealcvClient> client, const Camera& camera, const Workers& workers, int samples)
      : client_(std::move(client)),
        rays_(camera),
        view_(require_pinhole(camera, rays_, client_->options().name)),
        samples_(samples),
        workers_(workers) {}

  RendererTraits traits() const override {
    const UnrealcvOptions& options = client_->options();
    return {.name = options.name,
            .granularity = Granularity::frame,
            .device = options.host + ":" + std::to_string(options.port)};
  }

  std::unique_ptr<Rendering> start(RenderRequest request) override {
    if (request.objects.size() != client_->options().objects.size())
      throw InternalError("the number of objects in a request must be the number of moving objects in the scene");
    EngineView view{view_.width, view_.height, view_.fx, request.camera.T_world_body};
    view.samples = samples_;
    for (const Kinematics& object : request.objects) view.objects.push_back(object.T_world_body);
    return std::make_unique<UnderWay>(*this, std::move(request), client_->start(std::move(view)));
  }

 private:
  struct UnderWay final : Rendering {
    UnderWay(UnrealcvRenderer& from, RenderRequest what, std::shared_ptr<UnrealcvClient::Asked> engine)
        : renderer(from), request(std::move(what)), asked(std::move(engine)) {}
    ~UnderWay() override {
      if (asked) renderer.client_->abandon(asked);
    }
    UnderWay(const UnderWay&) = delete;
    UnderWay& operator=(const UnderWay&) = delete;

    void finish(Sample& sample) override {
      UnrealcvRenderer& r = renderer;
      r.client_->finish(asked, r.workers_, r.image_, [&] {
        render_in_bands({&request, 1}, r.rays_, r.workers_, sample,
                        [&](std::size_t, const Tile& band) { look_up_geometry(r.view_, r.image_, band, sample); });
      });
      asked.reset();
      render_in_bands({&request, 1}, r.rays_.x.width(), r.rays_.x.height(), r.workers_, sample,
                      [&](std::size_t, const Tile& band) { look_up_light(r.view_, r.image_, band, sample); });
    }

    UnrealcvRenderer& renderer;
    RenderRequest request;
    std::shared_ptr<UnrealcvClient::Asked> asked;
  };

  std::shared_ptr<UnrealcvClient> client_;
  PixelRays rays_;
  PinholeView view_;
  int samples_;
  const Workers& workers_;
  PinholeImage image_;
};

}  // namespace

std::shared_ptr<UnrealcvClient> make_unrealcv_client(UnrealcvOptions options) {
  return std::make_shared<UnrealcvClient>(std::move(options));
}

std::vector<std::string> description_by(UnrealcvClient& client) {
  return client.ask({"vget /unrealcv/version", "vget /objects"});
}

std::unique_ptr<Renderer> make_unrealcv_renderer(std::shared_ptr<UnrealcvClient> client, const Camera& camera,
                                                 const Workers& workers, int samples) {
  return std::make_unique<UnrealcvRenderer>(std::move(client), camera, workers, samples);
}

}  // namespace esim::inline backends::inline unrealcv
