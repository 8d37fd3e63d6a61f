#include <fmt/format.h>

#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "esim/blender/blender.h"
#include "esim/compose/compose.h"
#include "esim/compose/load_lighting.h"
#include "esim/core/error.h"
#include "esim/geometry/upright.h"
#include "esim/scene/deformation/adapted.h"
#include "esim/scene/splats/splat_file.h"
#include "esim/scene/vertices/vertex_file.h"

namespace esim::inline compose {
namespace {

void require_scene_path(const std::filesystem::path& path, const std::string& key) {
  if (path.empty()) throw UserError(fmt::format("renderer.{}: is missing; name a file", key));
}

/// The file to read for the scene file that a scenario names: itself, or Blender's export of a .blend.
std::filesystem::path readable(const std::filesystem::path& scene, const Notices& notices) {
  if (!is_blend(scene)) return scene;
  BlenderWatch watch;
  watch.warning = notices.warning;
  std::filesystem::path glb = cached_glb(scene, watch);
  notices.note(fmt::format("scene {}: reading the GLB that Blender exported from it, {}", scene.filename().string(),
                           glb.string()));
  return glb;
}

/// Loads splats with the options of their renderer.
Splats splats_of(const std::filesystem::path& path, double scale, const SplatsRendererOptions& options,
                 const Notices& notices) {
  Splats splats = load_splats(path, notices.warning);
  for (Eigen::Vector3f& position : splats.positions) position *= static_cast<float>(scale);
  for (Eigen::Vector3f& deviation : splats.deviations) deviation *= static_cast<float>(scale);
  if (options.filter) splats.filter = *options.filter;
  if (options.light) splats.light = *options.light;
  notices.note(fmt::format("scene {}: {}", path.filename().string(), summary(splats)));
  if (const double white = share_at_white(splats); white > 0.001) {
    notices.note(
        fmt::format("scene {}: {:.1f} % of its surface is at the display's white; how bright it was is lost, so that "
                    "contrasts there are too low",
                    path.filename().string(), 100 * white));
  }
  return splats;
}

/// The scene's own splats, upright.
Splats upright_splats(const SplatsRendererOptions& options, const Notices& notices) {
  Splats splats = splats_of(options.scene, options.scale, options, notices);
  if (!options.up) return splats;
  try {
    splats.to_object = upright(*options.up);
  } catch (const UserError& error) {
    throw UserError(fmt::format("renderer.{}", error.what()));
  }
  return splats;
}

/// Loads the objects that a scenario lists. Those of the same files, animation and scale share their textures and
/// deformation.
class ObjectLoader {
 public:
  ObjectLoader(const SplatsRendererOptions* with_splats, SceneLook look, SurfaceModel model, const Notices& notices)
      : with_splats_(with_splats), look_(look), model_(model), notices_(notices) {}

  /// An object: a mesh, or splats for a renderer with these.
  SceneObject load(const ObjectOptions& options, const std::string& key) {
    const auto [known, is_new] =
        loaded_.try_emplace({options.scene, options.scale, options.animation.name, options.vertices});
    if (is_new) known->second = read(options, key);
    SceneObject object = known->second;
    object.name = options.name;
    return object;
  }

 private:
  SceneObject read(const ObjectOptions& options, const std::string& key) const {
    SceneObject object{{}, {}, true};
    if (with_splats_ != nullptr && !options.vertices && is_splat_file(options.scene)) {
      object.splats = std::make_shared<const Splats>(splats_of(options.scene, options.scale, *with_splats_, notices_));
      return object;
    }
    object = mesh_of(options, key);
    object.moves = true;
    for (Eigen::Vector3f& vertex : object.mesh.vertices) vertex *= static_cast<float>(options.scale);
    if (object.deformation == nullptr) return object;
    const TimeSpan span = object.deformation->span();
    notices_.note(fmt::format("scene {}: deforms; animation from {:.3f} to {:.3f} s", options.scene.filename().string(),
                              to_seconds(span.start), to_seconds(span.end)));
    if (options.scale != 1) object.deformation = scaled(std::move(object.deformation), options.scale);
    return object;
  }

  SceneObject mesh_of(const ObjectOptions& options, const std::string& key) const {
    const std::string& animation = options.animation.name;
    if (!options.vertices)
      return load_scene_object(readable(options.scene, notices_), notices_.warning, look_, model_, animation);
    if (!animation.empty())
      throw UserError(
          fmt::format("{}.animation.name: must be left out, since the vertices of a file have no names", key));
    require_scene_path(options.vertices->file, key + ".vertices.file");
    return load_object_with_vertices(options.scene, *options.vertices, notices_.warning, look_, model_);
  }

  const SplatsRendererOptions* with_splats_;
  SceneLook look_;
  SurfaceModel model_;
  const Notices& notices_;
  std::map<std::tuple<std::filesystem::path, double, std::string, std::optional<VertexFile>>, SceneObject> loaded_;
};

/// Adds the objects that a scenario lists, and the light.
void add_objects(const std::vector<ObjectOptions>& objects, const LightingOptions& lighting,
                 const SplatsRendererOptions* with_splats, SceneLook look, const Notices& notices, SceneFile& file) {
  ObjectLoader loader(with_splats, look, surface_model(lighting), notices);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::string key = fmt::format("objects.{}", i);
    require_scene_path(objects[i].scene, key + ".scene");
    SceneObject loaded = loader.load(objects[i], key);
    if (loaded.name.empty()) loaded.name = fmt::format("object{}", i);
    for (const SceneObject& other : file.scene.objects) {
      if (!other.moves || other.name != loaded.name) continue;
      throw UserError(fmt::format(
          "renderer.objects.{}.name: must be unique, but another object is also named {}; rename one", i, loaded.name));
    }
    file.scene.objects.push_back(std::move(loaded));
  }
  file.scene.lighting = load_lighting(lighting, file.scene, look);
}

SceneFile load(const MeshRendererOptions& options, SceneLook look, const Notices& notices) {
  require_scene_path(options.scene, "scene");
  SceneFile file =
      load_scene_file(readable(options.scene, notices), notices.warning, look, surface_model(options.lighting));
  notices.note(fmt::format("scene {}: {}", options.scene.filename().string(), summary(file)));
  add_objects(options.objects, options.lighting, nullptr, look, notices, file);
  return file;
}

SceneFile load(const SplatsRendererOptions& options, SceneLook look, const Notices& notices) {
  require_scene_path(options.scene, "scene");
  SceneFile file;
  if (is_splat_file(options.scene)) {
    file.scene.objects.push_back({"", {}, false, std::make_shared<const Splats>(upright_splats(options, notices))});
  } else {
    file = load_scene_file(readable(options.scene, notices), notices.warning, look, surface_model(options.lighting));
    notices.note(fmt::format("scene {}: {}", options.scene.filename().string(), summary(file)));
  }
  add_objects(options.objects, options.lighting, &options, look, notices, file);
  if (file.scene.lighting && file.scene.lighting->environment_visible) {
    throw UserError(
        "renderer.lighting.environment.visible: must be false with splats, which have their own surroundings");
  }
  return file;
}

template <typename Renderer>
SceneFile load(const Renderer&, SceneLook, const Notices&) {
  return {};
}

/// Only the cameras and the animation's time span of the scene that Blender renders.
SceneFile load_cameras(const BlenderRendererOptions& options, const Notices& notices) {
  if (options.scene.empty()) {
    throw UserError(
        "renderer.scene: is missing, but the trajectory follows a camera of the scene; name the file that the Blender "
        "at renderer.address has opened");
  }
  SceneFile file = load_scene_file(readable(options.scene, notices), [](const std::string&) {});
  if (file.cameras.empty())
    throw UserError(fmt::format("trajectory: {} has no camera; use file, random or static", options.scene.string()));
  SceneFile cameras;
  cameras.cameras = std::move(file.cameras);
  cameras.animation = file.animation;
  return cameras;
}

}  // namespace

SceneFile load_scenes(const Scenario& scenario, SceneLook look, const Notices& notices) {
  const auto* const blender = std::get_if<BlenderRendererOptions>(&scenario.renderer);
  if (blender != nullptr && std::holds_alternative<SceneTrajectoryOptions>(scenario.trajectory))
    return load_cameras(*blender, notices);
  return std::visit([&](const auto& renderer) { return load(renderer, look, notices); }, scenario.renderer);
}

void play_deformations(const Scenario& scenario, TimeNs body_start, SceneFile& file) {
  const auto* const listed = listed_objects(scenario.renderer);
  if (listed == nullptr) return;
  const auto* const mesh = std::get_if<MeshRendererOptions>(&scenario.renderer);
  std::size_t index = 0;  // of the moving object
  for (SceneObject& object : file.scene.objects) {
    if (!object.moves) continue;
    const std::size_t i = index++;
    if (object.deformation == nullptr) continue;
    AnimationClock clock{body_start, mesh != nullptr ? mesh->time_scale : 1};
    if (i >= file.motions.size()) {
      const AnimationOptions& options = (*listed)[i - file.motions.size()].animation;
      clock = {body_start, options.time_scale, to_ns(options.offset_s), options.repeat};
    }
    object.deformation = retimed(std::move(object.deformation), clock);
  }
}

}  // namespace esim::inline compose
