#include <fmt/format.h>

#include "esim/backends/panorama/panorama_renderer.h"
#include "esim/backends/plane/plane_renderer.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/backends/sprites/sprites_renderer.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scene/image_file.h"
#include "esim/scene/mesh.h"

namespace esim {
namespace {

void require_path(const std::filesystem::path& path, const char* key) {
  if (path.empty()) throw UserError(fmt::format("renderer.{}: is missing; name a file", key));
}

Sprite load_sprite(const LayerOptions& options) {
  if (options.image.empty()) throw UserError("image is missing; name a file");
  const TranslucentImage image = load_translucent(options.image, {options.median_px, options.gaussian_px});
  const Wrap wrap = options.beyond == LayerBeyond::repeat ? Wrap::repeat : Wrap::clamp;
  const auto texture = [&](const Image<float>& plane) {
    return plane.empty() ? nullptr : std::make_shared<const Texture>(plane, wrap, wrap);
  };
  const auto keyframes = options.keyframes.empty() ? std::vector{LayerKeyframe{}} : options.keyframes;
  return {texture(image.light), texture(image.alpha), options.units, options.beyond,
          LayerMotion(keyframes, options.interpolation)};
}

// One overload per type of renderer: a new one is a line in RendererOptions and a function here.

RendererFactory factory(const MeshRendererOptions& options, const Notices& notices) {
  require_path(options.scene, "scene");
  const auto scene = build_raycast_scene(load_mesh(options.scene, notices.warning));
  const RaycastOptions raycast{static_cast<float>(options.background), options.samples_per_pixel};
  return [=](const Camera& camera, const Workers& workers) {
    return make_raycast_renderer(scene, raycast, camera, workers);
  };
}

RendererFactory factory(const PanoramaRendererOptions& options, const Notices&) {
  require_path(options.image, "image");
  if (!(options.orientation.norm() > 1e-6))
    throw UserError("renderer.orientation: [0, 0, 0, 0] is no orientation; use [0, 0, 0, 1]");
  const Panorama panorama{std::make_shared<const Texture>(load_luminance(options.image), Wrap::repeat, Wrap::clamp),
                          Eigen::Quaterniond(options.orientation.normalized())};
  return
      [=](const Camera& camera, const Workers& workers) { return make_panorama_renderer(panorama, camera, workers); };
}

RendererFactory factory(const PlaneRendererOptions& options, const Notices&) {
  require_path(options.image, "image");
  const Wrap wrap = options.endless ? Wrap::repeat : Wrap::clamp;
  const Poster poster{std::make_shared<const Texture>(load_luminance(options.image), wrap, wrap), pose_of(options.pose),
                      options.width_m, options.endless, static_cast<float>(options.background)};
  return [=](const Camera& camera, const Workers& workers) { return make_plane_renderer(poster, camera, workers); };
}

RendererFactory factory(const SpritesRendererOptions& options, const Notices&) {
  if (options.layers.empty())
    throw UserError("renderer: sprites without layers show nothing; list layers, or name a scene file in scene");
  SpriteScene scene{{}, static_cast<float>(options.background)};
  for (std::size_t i = 0; i < options.layers.size(); ++i) {
    try {
      scene.sprites.push_back(load_sprite(options.layers[i]));
    } catch (const UserError& error) {
      throw UserError(fmt::format("renderer.layers.{}: {}", i, error.what()));
    }
  }
  return [=](const Camera& camera, const Workers& workers) { return make_sprites_renderer(scene, camera, workers); };
}

}  // namespace

RendererFactory build_renderer_factory(const RendererOptions& options, const Notices& notices) {
  return std::visit([&](const auto& renderer) { return factory(renderer, notices); }, options);
}

}  // namespace esim
