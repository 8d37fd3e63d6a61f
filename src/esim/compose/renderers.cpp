#include <fmt/format.h>

#include <algorithm>

#include "esim/backends/opengl/gl_renderer.h"
#include "esim/backends/panorama/panorama_renderer.h"
#include "esim/backends/plane/plane_renderer.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scene/image_file.h"
#include "esim/scene/scene.h"

namespace esim {
namespace {

void require_path(const std::filesystem::path& path, const std::string& key) {
  if (path.empty()) throw UserError(fmt::format("renderer.{}: is missing; name a file", key));
}

Lighting lighting_of(const LambertOptions& options) {
  Lighting lighting;
  lighting.ambient = static_cast<float>(options.ambient);
  for (const SunOptions& sun : options.suns) {
    if (!(sun.direction.norm() > 1e-6))
      throw UserError("renderer.lighting.suns: [0, 0, 0] is no direction; [0, 0, -1] shines straight down");
    lighting.suns.push_back({sun.direction.cast<float>(), static_cast<float>(sun.strength)});
  }
  for (const PointLightOptions& point : options.points)
    lighting.points.push_back({point.position.cast<float>(), static_cast<float>(point.strength)});
  lighting.shadows = options.shadows;
  return lighting;
}

/// The objects' meshes, each in its own coordinates but in metres.
Scene load_scene(const MeshRendererOptions& options, const Notices& notices) {
  require_path(options.scene, "scene");
  Scene scene = still_scene(load_mesh(options.scene, notices.warning));
  for (std::size_t i = 0; i < options.objects.size(); ++i) {
    const ObjectOptions& object = options.objects[i];
    require_path(object.scene, fmt::format("objects.{}.scene", i));
    SceneObject loaded{object.name.empty() ? fmt::format("object{}", i) : object.name,
                       load_mesh(object.scene, notices.warning), true};
    for (Eigen::Vector3f& vertex : loaded.mesh.vertices) vertex *= static_cast<float>(object.scale);
    scene.objects.push_back(std::move(loaded));
  }
  if (const auto* lambert = std::get_if<LambertOptions>(&options.lighting)) scene.lighting = lighting_of(*lambert);
  return scene;
}

// One overload per type of renderer: a new one is a line in RendererOptions and a function here.

/// OpenGL where there is a graphics card for it.
MeshEngine choose_engine(const MeshRendererOptions& options) {
  if (options.engine != MeshEngine::automatic) return options.engine;
  const std::vector<GlDevice> devices = gl_devices();
  const bool hardware = std::any_of(devices.begin(), devices.end(), [](const GlDevice& d) { return !d.software; });
  return hardware ? MeshEngine::gl : MeshEngine::raycast;
}

RendererFactory factory(const MeshRendererOptions& options, const Notices& notices) {
  if (choose_engine(options) == MeshEngine::gl) {
    const auto scene = std::make_shared<const Scene>(load_scene(options, notices));
    const GlOptions gl{static_cast<float>(options.background), options.samples_per_pixel, options.gl_device};
    return [=](const Camera& camera, const Workers& workers) { return make_gl_renderer(scene, gl, camera, workers); };
  }
  const auto scene = build_raycast_scene(load_scene(options, notices));
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

}  // namespace

RendererFactory build_renderer_factory(const RendererOptions& options, const Notices& notices) {
  return std::visit([&](const auto& renderer) { return factory(renderer, notices); }, options);
}

}  // namespace esim
