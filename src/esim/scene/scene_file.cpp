#include "esim/scene/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <set>

#include "esim/files/input_file.h"
#include "esim/scene/import/flatten.h"

namespace esim::inline scene {
namespace {

/// `animation`: the name of the one that is played; empty: all.
SceneGraph read_graph(const std::filesystem::path& path, const std::string& animation = {}) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) fail_scene(path, "no such file");
  const std::string extension = lower_extension(path);
  if (extension == ".gltf" || extension == ".glb") return read_gltf(path, animation);
  if (!animation.empty())
    fail_scene(path, fmt::format("has no animation {}; only those of glTF files have names", animation));
  for (const char* const known : {".obj", ".ply", ".stl", ".fbx", ".dae"}) {
    if (extension == known) return read_with_assimp(path);
  }
  fail_scene(path,
             "its format is not supported; use GLB, glTF, OBJ, PLY, STL, FBX, Collada (.dae) or Blender's (.blend)");
}

std::string counted(std::size_t count, const char* singular, const char* plural) {
  return fmt::format("{} {}", count, count == 1 ? singular : plural);
}

}  // namespace

SceneFile load_scene_file(const std::filesystem::path& path, const WarningHandler& warn, SceneLook look,
                          SurfaceModel model) {
  return flatten(read_graph(path), path, warn, look, model);
}

Mesh load_mesh(const std::filesystem::path& path, const WarningHandler& warn, SceneLook look, SurfaceModel model) {
  return flatten_joined(read_graph(path), path, warn, look, model, false).mesh;
}

SceneObject load_scene_object(const std::filesystem::path& path, const WarningHandler& warn, SceneLook look,
                              SurfaceModel model, const std::string& animation) {
  return flatten_joined(read_graph(path, animation), path, warn, look, model, true);
}

std::string summary(const SceneFile& file) {
  std::size_t triangles = 0;
  for (const SceneObject& object : file.scene.objects) triangles += object.mesh.triangles.size();
  std::set<std::uint32_t> used;  // all objects have the same list
  for (const SceneObject& object : file.scene.objects)
    used.insert(object.mesh.material.begin(), object.mesh.material.end());
  std::string text =
      fmt::format("{}, {}, {}", counted(triangles, "triangle", "triangles"),
                  counted(used.size(), "material", "materials"), counted(file.image_count, "texture", "textures"));

  std::string names;
  for (const SceneObject& object : file.scene.objects) {
    if (object.moves) names += (names.empty() ? "" : ", ") + object.name + (object.deformation ? " (deforms)" : "");
  }
  text += names.empty() ? "; no moving objects"
                        : fmt::format("; moving {}: {}", counted(file.motions.size(), "object", "objects"), names);
  if (file.animation.end > file.animation.start) {
    text += fmt::format("; animation from {:.3f} to {:.3f} s", to_seconds(file.animation.start),
                        to_seconds(file.animation.end));
  }
  std::string cameras;
  for (const SceneCamera& camera : file.cameras) {
    cameras += (cameras.empty() ? "" : ", ") + camera.name;
    if (camera.horizontal_fov_rad)
      cameras += fmt::format(" ({:.1f} deg)", *camera.horizontal_fov_rad * 180 / std::numbers::pi);
    if (camera.motion.size() > 1) cameras += " moving";
  }
  return text + (cameras.empty() ? "; no cameras"
                                 : fmt::format("; {}: {}", file.cameras.size() == 1 ? "camera" : "cameras", cameras));
}

}  // namespace esim::inline scene
