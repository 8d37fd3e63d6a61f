#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "esim/backends/opengl/gl_renderer.h"
#include "esim/backends/opengl/splats/gl_splat_renderer.h"
#include "esim/backends/panorama/panorama_renderer.h"
#include "esim/backends/plane/plane_renderer.h"
#include "esim/backends/raycast/raster/raster_renderer.h"
#include "esim/backends/raycast/raycast_renderer.h"
#include "esim/backends/splats/splat_renderer.h"
#include "esim/backends/sprites/sprites_renderer.h"
#include "esim/backends/unrealcv/unrealcv_renderer.h"
#include "esim/compose/compose.h"
#include "esim/compose/engines/engine_images.h"
#include "esim/core/error.h"
#include "esim/image_cache/cached_renderer.h"
#include "esim/scene/images/image_file.h"

namespace esim::inline compose {
namespace {

void require_path(const std::filesystem::path& path, const std::string& key) {
  if (path.empty()) throw UserError(fmt::format("renderer.{}: is missing; name a file", key));
}

void refuse(ColourFilters filters, const char* renderer, const char* instead) {
  if (filters != ColourFilters::none)
    throw UserError(fmt::format("colour: {} renders luminance only; use {}, or colour: none", renderer, instead));
}

/// A factory of renderers whose pixels can average over other areas: make(camera, filters, area, workers).
template <typename Make>
RendererFactory with_area(const Make& make) {
  return {[make](const Camera& camera, ColourFilters filters, const Workers& workers) -> std::unique_ptr<Renderer> {
            return make(camera, filters, PixelArea{}, workers);
          },
          [make](const Camera& camera, const PixelArea& area, const Workers& workers) -> std::unique_ptr<Renderer> {
            return make(camera, ColourFilters::none, area, workers);
          }};
}

/// The same for scenes without edges, which have only one area: make(camera, filters, footprint, workers).
template <typename Make>
auto without_edges(const Make& make) {
  return [make](const Camera& camera, ColourFilters filters, const PixelArea& area, const Workers& workers) {
    return area.edges == area.texture ? make(camera, filters, area.texture, workers) : nullptr;
  };
}

// One overload per type of renderer (scenario/renderer_options.h).

/// Whether OpenGL is preferable: if there is a graphics card and no camera sees colour.
bool prefers_gl(bool colour) {
  if (colour) return false;
  const std::vector<GlDevice> devices = gl_devices();
  return std::any_of(devices.begin(), devices.end(), [](const GlDevice& device) { return !device.software; });
}

/// Throws UserError unless all splats are blended in the same space.
void require_same_light(const std::vector<SplatObject>& objects) {
  for (const SplatObject& object : objects) {
    if (object.splats->light == objects.front().splats->light) continue;
    throw UserError(
        "renderer.light: is missing, but some of the splats are in linear light and others in display colours; set it "
        "to linear or display");
  }
}

/// Renumbers the objects that carry lights: by their place among the objects with these numbers.
void count_carriers_among(const std::vector<std::size_t>& numbers, Lighting& lighting) {
  const auto renumber = [&](std::optional<std::size_t>& object) {
    if (object) object = static_cast<std::size_t>(std::ranges::find(numbers, *object) - numbers.begin());
  };
  for (PointLight& light : lighting.points) renumber(light.object);
  for (AreaLight& light : lighting.areas) renumber(light.object);
}

/// The engine on the processor that suits the scene. Rays are faster if there are many triangles in each pixel, or if
/// one ray per pixel is enough (bench_renderers).
MeshEngine choose_for_processor(const MeshRendererOptions& options, const Scene& scene) {
  constexpr std::size_t kMostTriangles = 200'000;
  std::size_t triangles = 0;
  for (const SceneObject& object : scene.objects) triangles += object.mesh.triangles.size();
  return options.samples_per_pixel > 1 && triangles <= kMostTriangles ? MeshEngine::raster : MeshEngine::raycast;
}

RendererFactory factory(const MeshRendererOptions& options, const SceneFile& file, bool colour) {
  MeshEngine engine = options.engine;
  if (engine == MeshEngine::automatic) engine = prefers_gl(colour) ? MeshEngine::gl : MeshEngine::processor;
  if (engine == MeshEngine::processor) engine = choose_for_processor(options, file.scene);
  if (engine == MeshEngine::gl) {
    const GlOptions gl{static_cast<float>(options.background), options.samples_per_pixel, options.gl_device};
    return {[gl, scene = std::make_shared<const Scene>(file.scene)](const Camera& camera, ColourFilters filters,
                                                                    const Workers&) {
      refuse(filters, "engine: gl", "engine: processor");
      return make_gl_renderer(*scene, gl, camera);
    }};
  }
  if (engine == MeshEngine::raster) {
    const RasterOptions raster{static_cast<float>(options.background), options.samples_per_pixel};
    return with_area([raster, scene = build_raster_scene(file.scene)](const Camera& camera, ColourFilters filters,
                                                                      const PixelArea& area, const Workers& workers) {
      return make_raster_renderer(scene, raster, camera, workers, filters, area);
    });
  }
  const auto scene = build_raycast_scene(file.scene);
  const RaycastOptions raycast{static_cast<float>(options.background), options.samples_per_pixel};
  return with_area([=](const Camera& camera, ColourFilters filters, const PixelArea& area, const Workers& workers) {
    return make_raycast_renderer(scene, raycast, camera, workers, filters, area);
  });
}

RendererFactory factory(const SplatsRendererOptions& options, const SceneFile& file, bool colour) {
  std::vector<SplatObject> objects;
  SceneFile meshes;
  meshes.scene.lighting = file.scene.lighting;
  std::vector<std::size_t> moving_meshes;
  std::size_t moving = 0;
  for (const SceneObject& object : file.scene.objects) {
    const std::optional<std::size_t> number = object.moves ? std::optional(moving++) : std::nullopt;
    if (object.splats != nullptr) {
      objects.push_back({object.splats, number});
    } else {
      meshes.scene.objects.push_back(object);
      if (number) moving_meshes.push_back(*number);
    }
  }
  require_same_light(objects);
  if (meshes.scene.lighting) count_carriers_among(moving_meshes, *meshes.scene.lighting);
  const bool only_splats = meshes.scene.objects.empty();
  if (options.engine == SplatsEngine::gl && !only_splats)
    throw UserError("renderer.engine: gl cannot render meshes among splats; use processor");
  if (options.engine == SplatsEngine::gl && options.order == SplatOrder::ray)
    throw UserError("renderer.order: ray needs engine: processor, not gl; or choose distance");
  MeshRendererOptions mesh;
  mesh.background = options.background;
  std::optional<RendererFactory> make_surfaces;
  if (!only_splats) make_surfaces = factory(mesh, meshes, colour);

  SplatOptions splats;
  splats.projection = options.projection;
  splats.order = options.order;
  splats.display_gamma = options.display_gamma;
  splats.background = static_cast<float>(options.background);
  splats.gain = static_cast<float>(options.gain);
  const bool automatic_gl = options.engine == SplatsEngine::automatic && only_splats &&
                            options.order != SplatOrder::ray && prefers_gl(colour);
  if (options.engine == SplatsEngine::gl || automatic_gl) {
    return with_area(without_edges([objects, splats, device = options.gl_device](
                                       const Camera& camera, ColourFilters filters, double footprint, const Workers&) {
      refuse(filters, "engine: gl", "engine: processor");
      return make_gl_splat_renderer(objects, splats, camera, device, footprint);
    }));
  }
  const auto scene = build_splat_scene(objects);
  return with_area(
      without_edges([=](const Camera& camera, ColourFilters filters, double footprint, const Workers& workers) {
        SplatSurfaces surfaces;
        if (make_surfaces) {
          surfaces.renderer = footprint == 1 ? make_surfaces->make(camera, filters, workers)
                                             : make_surfaces->make_with_area(camera, {footprint, footprint}, workers);
          surfaces.objects = moving_meshes;
        }
        return make_splat_renderer(scene, splats, camera, workers, filters, footprint, std::move(surfaces));
      }));
}

RendererFactory factory(const PanoramaRendererOptions& options, const SceneFile&, bool colour) {
  require_path(options.image, "image");
  if (!(options.orientation.norm() > 1e-6))
    throw UserError("renderer.orientation: must not be [0, 0, 0, 0]; use [0, 0, 0, 1]");
  const Softening softening{options.median_px, options.gaussian_px, true};
  Panorama panorama{
      std::make_shared<const Texture>(load_luminance(options.image, softening), Wrap::repeat, Wrap::clamp),
      Eigen::Quaterniond(options.orientation.normalized())};
  if (colour) panorama.colours = colour_textures(load_colours(options.image, softening), Wrap::repeat, Wrap::clamp);
  return with_area(
      without_edges([=](const Camera& camera, ColourFilters filters, double footprint, const Workers& workers) {
        return make_panorama_renderer(panorama, camera, workers, filters, footprint);
      }));
}

RendererFactory factory(const PlaneRendererOptions& options, const SceneFile&, bool colour) {
  require_path(options.image, "image");
  const Wrap wrap = options.endless ? Wrap::repeat : Wrap::clamp;
  const Softening softening{options.median_px, options.gaussian_px};
  TexturedPlane plane{std::make_shared<const Texture>(load_luminance(options.image, softening), wrap, wrap),
                      pose_of(options.pose), options.width_m, options.endless, static_cast<float>(options.background)};
  if (colour) plane.colours = colour_textures(load_colours(options.image, softening), wrap, wrap);
  return with_area(
      without_edges([=](const Camera& camera, ColourFilters filters, double footprint, const Workers& workers) {
        return make_plane_renderer(plane, camera, workers, filters, footprint);
      }));
}

/// The textures of sprites. Sprites with the same image and filters share them.
class SpriteTextures {
 public:
  struct Textures {
    std::shared_ptr<const Texture> light, alpha;
  };

  const Textures& of(const SpriteOptions& sprite) {
    const Wrap wrap = sprite.beyond == SpriteBeyond::repeat ? Wrap::repeat : Wrap::clamp;
    const auto [entry, is_new] = loaded_.try_emplace({sprite.image, sprite.median_px, sprite.gaussian_px, wrap});
    if (is_new) {
      const TranslucentImage image = load_translucent(sprite.image, {sprite.median_px, sprite.gaussian_px});
      entry->second.light = std::make_shared<const Texture>(image.light, wrap, wrap);
      if (!image.alpha.empty()) entry->second.alpha = std::make_shared<const Texture>(image.alpha, wrap, wrap);
    }
    return entry->second;
  }

 private:
  std::map<std::tuple<std::filesystem::path, int, double, Wrap>, Textures> loaded_;
};

RendererFactory factory(const SpritesRendererOptions& options, const SceneFile&, bool) {
  if (options.sprites.empty())
    throw UserError("renderer.sprites: is missing; list sprites, or name a .scene file in renderer.scene");
  SpriteScene scene{{}, static_cast<float>(options.background)};
  SpriteTextures textures;
  for (std::size_t i = 0; i < options.sprites.size(); ++i) {
    const SpriteOptions& sprite = options.sprites[i];
    require_path(sprite.image, fmt::format("sprites.{}.image", i));
    try {
      const auto& [light, alpha] = textures.of(sprite);
      scene.sprites.push_back(
          {light, alpha, sprite.units, sprite.beyond, SpriteMotion(sprite.poses, sprite.interpolation), sprite.pivot});
    } catch (const UserError& error) {
      throw UserError(fmt::format("renderer.sprites.{}: {}", i, error.what()));
    }
  }
  return {[=](const Camera& camera, ColourFilters filters, const Workers& workers) {
    refuse(filters, "the renderer sprites", "a mesh, a plane or a panorama");
    return make_sprites_renderer(scene, camera, workers);
  }};
}

RendererFactory factory(const UnrealcvRendererOptions& options, const std::shared_ptr<ImageCache>& cache) {
  UnrealcvOptions engine;
  engine.host = options.host;
  engine.port = options.port;
  engine.timeout_s = options.timeout_s;
  engine.camera = options.camera;
  engine.pipelined = options.pipelined;
  engine.lag_frames = options.lag_frames;
  engine.light = options.light;
  engine.exposure = options.exposure;
  engine.depth = options.depth;
  engine.mask = options.object_mask;
  for (const EngineObjectOptions& object : options.objects) engine.objects.push_back(object.name);
  const std::shared_ptr<UnrealcvClient> client = make_unrealcv_client(engine);
  std::string identity;
  if (cache != nullptr)
    identity = identity_of_images(engine, *client, {fmt::format("{}:{}", options.host, options.port)});
  return {[=](const Camera& camera, ColourFilters filters, const Workers& workers) {
    refuse(filters, "the renderer unrealcv", "a mesh, a plane or a panorama");
    return with_image_cache(make_unrealcv_renderer(client, camera, workers), cache, identity, camera, workers);
  }};
}

}  // namespace

RendererFactory build_renderer_factory(const RendererOptions& options, const SceneFile& scene, bool colour,
                                       const std::vector<CameraInfo>& sensors, const Notices& notices,
                                       const std::shared_ptr<ImageCache>& cache) {
  return std::visit(
      [&]<typename Options>(const Options& renderer) {
        if constexpr (std::is_same_v<Options, BlenderRendererOptions>) {
          return start_blender(renderer, sensors, notices, cache);
        } else if constexpr (std::is_same_v<Options, UnrealcvRendererOptions>) {
          return factory(renderer, cache);
        } else {
          return factory(renderer, scene, colour);
        }
      },
      options);
}

}  // namespace esim::inline compose
