#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "esim/blender/server.h"
#include "esim/compose/engines/engine_images.h"
#include "esim/core/error.h"
#include "esim/image_cache/cached_renderer.h"

namespace esim::inline compose {
namespace {

/// A started Blender and the connection to it, which is destroyed first.
struct StartedBlender {
  std::unique_ptr<BlenderServer> server;
  std::shared_ptr<UnrealcvClient> client;
};

/// "HOST:PORT".
void set_address(const std::string& address, UnrealcvOptions& engine) {
  const std::size_t colon = address.rfind(':');
  const char* const end = address.data() + address.size();
  const char* const port = address.data() + std::min(colon + 1, address.size());
  const auto [rest, error] = std::from_chars(port, end, engine.port);
  if (colon == std::string::npos || colon == 0 || error != std::errc() || rest != end || engine.port < 1 ||
      engine.port > 65535)
    throw UserError(fmt::format("renderer.address: must be HOST:PORT, such as 127.0.0.1:9000, not '{}'", address));
  engine.host = address.substr(0, colon);
}

/// Light paths per pixel. A keyframe has k x k pixels per pixel of the sensor, which are averaged later: together they
/// have as many paths as one pixel of the sensor.
int samples_for(const Camera& camera, const std::vector<CameraInfo>& sensors, int samples) {
  constexpr int kDensest = 4;
  for (int density = 1; density <= kDensest; ++density) {
    for (const CameraInfo& sensor : sensors) {
      if (std::abs(camera.fx / sensor.model.fx - density) < 1e-9) return std::max(1, samples / (density * density));
    }
  }
  return samples;
}

}  // namespace

RendererFactory start_blender(const BlenderRendererOptions& options, const std::vector<CameraInfo>& sensors,
                              const Notices& notices, std::shared_ptr<ImageCache> cache) {
  if (options.address.empty() && options.scene.empty())
    throw UserError(
        "renderer.scene: is missing; name a file, or set renderer.address to a Blender that already serves");
  UnrealcvOptions engine;
  engine.name = "blender";
  engine.timeout_s = options.timeout_s;
  engine.exposure = options.exposure;
  engine.light_image = "luminance";
  engine.light = EngineLight::npy;
  if (options.engine == BlenderEngine::eevee) engine.mask = EngineMask::none;
  for (const EngineObjectOptions& object : options.objects) engine.objects.push_back(object.name);
  auto blender = std::make_shared<StartedBlender>();
  std::vector<std::string> scene;  // what identifies it
  if (options.address.empty()) {
    blender->server = std::make_unique<BlenderServer>(
        BlenderServerOptions{options.scene, options.engine == BlenderEngine::eevee, options.samples, options.noise_seed,
                             options.threads, options.timeout_s},
        notices.warning);
    engine.port = blender->server->port();
    engine.why_ended = [server = blender->server.get()] { return server->why_ended(); };
    if (cache != nullptr) {
      if (auto files = identities_of(blender->server->files(), notices.warning)) {
        scene = std::move(*files);
        scene.push_back(options.scene.extension().string());
      } else {
        cache = nullptr;
      }
    }
  } else {
    set_address(options.address, engine);
    scene.push_back(options.address);
  }
  blender->client = make_unrealcv_client(engine);
  const std::shared_ptr<UnrealcvClient> client(blender, blender->client.get());
  std::string identity;
  if (cache != nullptr) {
    for (const int number : {static_cast<int>(options.engine), options.noise_seed, options.threads})
      scene.push_back(std::to_string(number));
    identity = identity_of_images(engine, *client, scene);
  }
  return {[=, samples = options.samples](const Camera& camera, ColourFilters filters, const Workers& workers) {
    if (filters != ColourFilters::none)
      throw UserError(
          "colour: the renderer blender renders luminance only; use a mesh, a plane or a panorama, or colour: none");
    const int paths = samples_for(camera, sensors, samples);
    return with_image_cache(make_unrealcv_renderer(client, camera, workers, paths), cache,
                            fmt::format("{} {}", identity, paths), camera, workers);
  }};
}

}  // namespace esim::inline compose
