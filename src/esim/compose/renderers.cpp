#include <fmt/format.h>

#include "esim/backends/panorama/panorama_renderer.h"
#include "esim/backends/plane/plane_renderer.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scene/image_file.h"

namespace esim {
namespace {

void require_path(const std::filesystem::path& path, const std::string& key) {
  if (path.empty()) throw UserError(fmt::format("renderer.{}: is missing; name a file", key));
}

// One overload per type of renderer: a new one is a line in RendererOptions and a function here.

RendererFactory factory(const MeshRendererOptions& options, const SceneFile& file) {
  const auto scene = build_raycast_scene(file.scene);
  const RaycastOptions raycast{static_cast<float>(options.background), options.samples_per_pixel};
  return [=](const Camera& camera, const Workers& workers) {
    return make_raycast_renderer(scene, raycast, camera, workers);
  };
}

RendererFactory factory(const PanoramaRendererOptions& options, const SceneFile&) {
  require_path(options.image, "image");
  if (!(options.orientation.norm() > 1e-6))
    throw UserError("renderer.orientation: [0, 0, 0, 0] is no orientation; use [0, 0, 0, 1]");
  const Panorama panorama{std::make_shared<const Texture>(load_luminance(options.image), Wrap::repeat, Wrap::clamp),
                          Eigen::Quaterniond(options.orientation.normalized())};
  return
      [=](const Camera& camera, const Workers& workers) { return make_panorama_renderer(panorama, camera, workers); };
}

RendererFactory factory(const PlaneRendererOptions& options, const SceneFile&) {
  require_path(options.image, "image");
  const Wrap wrap = options.endless ? Wrap::repeat : Wrap::clamp;
  const Poster poster{std::make_shared<const Texture>(load_luminance(options.image), wrap, wrap), pose_of(options.pose),
                      options.width_m, options.endless, static_cast<float>(options.background)};
  return [=](const Camera& camera, const Workers& workers) { return make_plane_renderer(poster, camera, workers); };
}

}  // namespace

RendererFactory build_renderer_factory(const RendererOptions& options, const SceneFile& scene) {
  return std::visit([&](const auto& renderer) { return factory(renderer, scene); }, options);
}

}  // namespace esim
