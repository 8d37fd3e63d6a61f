#include "esim/scene/import/flatten.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "esim/scene/import/gloss_textures.h"
#include "esim/scene/import/motion_samples.h"
#include "esim/scene/import/texture_store.h"

namespace esim::inline scene {
namespace {

constexpr float kMissingTextureBase = 0.2F;  // a mid-grey surface: 18-20 % reflectance
constexpr int kWorld = -1;

float seen(const Eigen::Vector3f& colour, View view) {
  if (view == View::luminance) return luminance(colour[0], colour[1], colour[2]);
  return colour[static_cast<int>(view)];
}

Material convert(const GraphMaterial& source, TextureStore& textures, View view) {
  Material material;
  material.name = source.name;
  material.unlit = source.unlit;
  material.base = seen(source.base, view);
  material.emission = seen(source.emission, view);
  if (textures.look() == SceneLook::coded) {
    material.coded = textures.coded(source.base_texture, source.name);
    if (source.base_texture.image >= 0 && material.coded == nullptr) material.base = kMissingTextureBase;
    if (source.emission.maxCoeff() <= 0 || source.emission_texture.image < 0) return material;
    material.coded_emission = textures.coded(source.emission_texture, source.name);
    if (material.coded_emission == nullptr) material.emission = 0;
    return material;
  }
  material.texture = textures.get(source.base_texture, source.base, source.name, view);
  if (source.base_texture.image >= 0) material.base = material.texture != nullptr ? 1.0F : kMissingTextureBase;
  if (material.emission > 0 && source.emission_texture.image >= 0) {
    material.emission_texture = textures.get(source.emission_texture, source.emission, source.name, view);
    material.emission = material.emission_texture != nullptr ? 1.0F : 0.0F;
  }
  return material;
}

/// A scene's materials, as in Mesh.
struct Materials {
  std::vector<Material> luminance;
  PerColour<std::vector<Material>> coloured;
};

/// Transforms the mesh of a node to the frame of its object, and appends it.
class MeshJoiner {
 public:
  MeshJoiner(const std::filesystem::path& file, SurfaceModel model) : file_(file), model_(model) {}

  void append(const Mesh& part, const Eigen::Matrix4d& T_object_node) {
    const Eigen::Matrix3f A = T_object_node.topLeftCorner<3, 3>().cast<float>();
    // A mirroring node turns triangles inside out, which matters only to the relief of their front (glTF 2.0, 3.7.4).
    const bool turn = model_ == SurfaceModel::glossy && A.determinant() < 0;
    const Eigen::Matrix3f for_normals =
        (turn ? -1.0F : 1.0F) * cofactors(T_object_node.topLeftCorner<3, 3>()).cast<float>();
    const Eigen::Vector3f t = T_object_node.topRightCorner<3, 1>().cast<float>();

    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (const Eigen::Vector3f& vertex : part.vertices) {
      mesh_.vertices.emplace_back(A * vertex + t);
      if (!mesh_.vertices.back().allFinite()) fail_scene(file_, "a vertex is not finite where its node puts it");
    }
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      const Eigen::Vector3f normal =
          part.normals.empty() ? Eigen::Vector3f::Zero() : Eigen::Vector3f(for_normals * part.normals[i]);
      const float length = normal.norm();
      const bool usable = length > 1e-12F && std::isfinite(length);
      mesh_.normals.push_back(usable ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::Zero());
      any_normals_ |= usable;
    }
    for (std::size_t i = 0; i < part.triangles.size(); ++i) {
      const auto& [a, b, c] = part.triangles[i];
      mesh_.triangles.push_back({first + a, first + b, first + c});
      mesh_.texture_uv.push_back(part.texture_uv[i]);
      if (!turn) continue;
      std::swap(mesh_.triangles.back()[1], mesh_.triangles.back()[2]);
      std::swap(mesh_.texture_uv.back()[1], mesh_.texture_uv.back()[2]);
    }
    mesh_.material.insert(mesh_.material.end(), part.material.begin(), part.material.end());
  }

  Mesh take(const Materials& materials) {
    if (!any_normals_) mesh_.normals.clear();
    mesh_.materials = materials.luminance;
    mesh_.coloured = materials.coloured;
    return std::move(mesh_);
  }

  bool empty() const { return mesh_.triangles.empty(); }

 private:
  /// det(A) A⁻ᵀ, which transforms normals as A transforms surfaces, also if A is singular.
  static Eigen::Matrix3d cofactors(const Eigen::Matrix3d& A) {
    Eigen::Matrix3d C;
    for (int i = 0; i < 3; ++i) C.col(i) = A.col((i + 1) % 3).cross(A.col((i + 2) % 3));
    return A.determinant() < 0 ? Eigen::Matrix3d(-C) : C;
  }

  const std::filesystem::path& file_;
  SurfaceModel model_;
  Mesh mesh_;
  bool any_normals_ = false;
};

/// Throws UserError if the nodes have no triangles, or too many.
void check_size(const SceneGraph& graph, const std::filesystem::path& file) {
  std::size_t triangles = 0, vertices = 0;
  for (const GraphNode& node : graph.nodes) {
    for (const std::uint32_t mesh : node.meshes) {
      triangles += graph.meshes[mesh].triangles.size(), vertices += graph.meshes[mesh].vertices.size();
      if (triangles > kMaxSceneTriangles || vertices > kMaxSceneVertices)
        fail_scene(file, fmt::format("has more than {} triangles; simplify it", kMaxSceneTriangles));
    }
  }
  if (triangles == 0) fail_scene(file, "contains no triangles; export meshes, not only curves, points or instances");
}

/// For each node, the animated node that moves it (itself, or its nearest animated ancestor), or the world.
std::vector<int> movers(const SceneGraph& graph, const NodeTransforms& transforms) {
  std::vector<int> result;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const int parent = graph.nodes[i].parent;
    result.push_back(transforms.is_animated(i) ? static_cast<int>(i)
                     : parent >= 0             ? result[static_cast<std::size_t>(parent)]
                                               : kWorld);
  }
  return result;
}

Materials convert_materials(const SceneGraph& graph, TextureStore& textures, SurfaceModel model) {
  Materials materials;
  GlossTextures gloss_textures(textures);
  for (const GraphMaterial& source : graph.materials) {
    const bool glossy = model == SurfaceModel::glossy && !source.unlit;
    const std::shared_ptr<const Gloss> gloss = glossy ? gloss_textures.convert(source) : nullptr;
    materials.luminance.push_back(convert(source, textures, View::luminance));
    materials.luminance.back().gloss = gloss;
    if (textures.look() == SceneLook::luminance) continue;
    for (const View view : {View::red, View::green, View::blue}) {
      std::vector<Material>& coloured = materials.coloured[static_cast<std::size_t>(view)];
      coloured.push_back(convert(source, textures, view));
      coloured.back().gloss = gloss;
    }
  }
  return materials;
}

void give_warnings(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                   SurfaceModel model) {
  constexpr std::size_t kMax = 10;  // one line each; a scene can have thousands of faults
  const bool glossy = model == SurfaceModel::glossy;
  std::vector<std::string> warnings = graph.warnings;
  if (glossy) warnings.insert(warnings.end(), graph.gloss_warnings.begin(), graph.gloss_warnings.end());
  for (std::size_t i = 0; i < std::min(warnings.size(), kMax); ++i) warn(warnings[i]);
  if (warnings.size() > kMax)
    warn(fmt::format("scene {}: {} more warnings of this kind", file.filename().string(), warnings.size() - kMax));
  const int ignored = glossy ? graph.bump_maps : graph.relief;
  if (ignored > 0)
    warn(fmt::format("scene {}: {} of its materials have a {}, which is ignored", file.filename().string(), ignored,
                     glossy ? "bump map of heights" : "normal or bump map"));
}

}  // namespace

SceneFile flatten(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                  SceneLook look, SurfaceModel model) {
  check_size(graph, file);
  give_warnings(graph, file, warn, model);
  SceneFile result;
  const NodeTransforms transforms(graph, file);
  result.animation = transforms.span();
  const double start_s = transforms.start_s();
  TextureStore textures(graph, file.parent_path(), warn, look);
  const Materials materials = convert_materials(graph, textures, model);
  result.image_count = textures.image_count();

  // The geometry of each mover, in the order of the nodes.
  const std::vector<int> mover_of = movers(graph, transforms);
  std::vector<int> objects = {kWorld};
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (mover_of[i] == static_cast<int>(i)) objects.push_back(static_cast<int>(i));
  }
  for (const int object : objects) {
    const bool moves = object != kWorld;
    SceneMotion motion;
    Eigen::Matrix4d T_object_world = Eigen::Matrix4d::Identity();
    if (moves) {
      const auto node = static_cast<std::size_t>(object);
      motion = sample_motion(transforms, node, Eigen::Matrix4d::Identity(), graph.nodes[node].name, warn);
      T_object_world = motion.front().T_world_object.inverse().matrix();
    }
    MeshJoiner joiner(file, model);
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      if (mover_of[i] != object) continue;
      for (const std::uint32_t mesh : graph.nodes[i].meshes)
        joiner.append(graph.meshes[mesh], T_object_world * transforms.world(i, start_s));
    }
    if (joiner.empty()) continue;
    Mesh mesh = joiner.take(materials);
    const std::string name = moves ? graph.nodes[static_cast<std::size_t>(object)].name : "world";
    result.scene.objects.push_back({name, std::move(mesh), moves});
    if (moves) result.motions.push_back(std::move(motion));
  }

  for (const GraphCamera& camera : graph.cameras) {
    SceneCamera converted{
        camera.name, {}, sample_motion(transforms, camera.node, camera.T_node_camera, camera.name, warn)};
    if (camera.horizontal_fov_rad > 0) converted.horizontal_fov_rad = camera.horizontal_fov_rad;
    result.cameras.push_back(std::move(converted));
  }
  return result;
}

Mesh flatten_still(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                   SceneLook look, SurfaceModel model) {
  check_size(graph, file);
  give_warnings(graph, file, warn, model);
  const NodeTransforms transforms(graph, file);
  TextureStore textures(graph, file.parent_path(), warn, look);
  MeshJoiner joiner(file, model);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    for (const std::uint32_t mesh : graph.nodes[i].meshes)
      joiner.append(graph.meshes[mesh], transforms.world(i, transforms.start_s()));
  }
  return joiner.take(convert_materials(graph, textures, model));
}

}  // namespace esim::inline scene
