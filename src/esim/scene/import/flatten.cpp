#include "esim/scene/import/flatten.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "esim/scene/import/deforming_mesh.h"
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
  explicit MeshJoiner(const std::filesystem::path& file) : file_(file) {}

  void append(const Mesh& part, const Eigen::Matrix4d& T_object_node) {
    const Eigen::Matrix3f A = T_object_node.topLeftCorner<3, 3>().cast<float>();
    const Eigen::Matrix3f for_normals = cofactors(T_object_node.topLeftCorner<3, 3>()).cast<float>();
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
    for (const auto& triangle : part.triangles)
      mesh_.triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
    mesh_.texture_uv.insert(mesh_.texture_uv.end(), part.texture_uv.begin(), part.texture_uv.end());
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

Materials convert_materials(const SceneGraph& graph, TextureStore& textures) {
  Materials materials;
  for (const GraphMaterial& source : graph.materials) {
    materials.luminance.push_back(convert(source, textures, View::luminance));
    if (textures.look() == SceneLook::luminance) continue;
    for (const View view : {View::red, View::green, View::blue})
      materials.coloured[static_cast<std::size_t>(view)].push_back(convert(source, textures, view));
  }
  return materials;
}

void give_warnings(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn) {
  constexpr std::size_t kMax = 10;  // one line each; a scene can have thousands of faults
  for (std::size_t i = 0; i < std::min(graph.warnings.size(), kMax); ++i) warn(graph.warnings[i]);
  if (graph.warnings.size() > kMax)
    warn(
        fmt::format("scene {}: {} more warnings of this kind", file.filename().string(), graph.warnings.size() - kMax));
  if (graph.normal_maps > 0)
    warn(fmt::format("scene {}: {} of its materials have a normal or bump map, which is ignored",
                     file.filename().string(), graph.normal_maps));
}

/// All parts of a graph.
std::vector<GraphPart> parts_of(const SceneGraph& graph) {
  std::vector<GraphPart> parts;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    for (const std::uint32_t mesh : graph.nodes[i].meshes) parts.push_back({i, mesh});
  }
  return parts;
}

/// Splits a graph into objects.
class Flattener {
 public:
  Flattener(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn, SceneLook look)
      : graph_(graph),
        file_(file),
        transforms_(graph, file),
        textures_(graph, file.parent_path(), warn, look),
        materials_(convert_materials(graph, textures_)) {}

  SceneFile objects(const WarningHandler& warn) {
    result_.animation = transforms_.span();
    result_.image_count = textures_.image_count();
    const std::vector<int> mover_of = movers(graph_, transforms_);
    std::map<int, std::vector<GraphPart>> parts;  // of each mover
    for (const GraphPart& part : parts_of(graph_))
      parts[is_skinned(graph_, part) ? kWorld : mover_of[part.node]].push_back(part);
    for (const auto& [mover, of_mover] : parts) add_mover(mover, of_mover);
    add_cameras(warn);
    return std::move(result_);
  }

  /// Everything as one object.
  SceneObject joined(const std::string& name, bool plays) {
    const std::vector<GraphPart> parts = parts_of(graph_);
    const bool moves = std::any_of(parts.begin(), parts.end(), [&](const GraphPart& part) {
      return deforms(graph_, transforms_, part) || (!is_skinned(graph_, part) && transforms_.moves(part.node));
    });
    SceneObject object{name, {}};
    if (plays && moves) {
      DeformingMesh mesh(graph_, transforms_, file_);
      for (const GraphPart& part : parts) mesh.append(part);
      object.mesh = mesh.take(object.deformation);
      add_materials(object.mesh);
      return object;
    }
    MeshJoiner joiner(file_);
    for (const GraphPart& part : parts) append_rest(part, Eigen::Matrix4d::Identity(), joiner);
    object.mesh = joiner.take(materials_);
    return object;
  }

 private:
  void append_rest(const GraphPart& part, const Eigen::Matrix4d& T_object_world, MeshJoiner& joiner) const {
    const Eigen::Matrix4d T_world_part = is_skinned(graph_, part) ? Eigen::Matrix4d(Eigen::Matrix4d::Identity())
                                                                  : transforms_.world(part.node, transforms_.start_s());
    joiner.append(shaped_at_start(graph_, transforms_, file_, part), T_object_world * T_world_part);
  }

  void add_materials(Mesh& mesh) const {
    mesh.materials = materials_.luminance;
    mesh.coloured = materials_.coloured;
  }

  void add(const std::string& name, Mesh mesh, const SceneMotion& motion,
           std::shared_ptr<const Deformation> deformation) {
    SceneObject object{unique_name(name), std::move(mesh), true};
    object.deformation = std::move(deformation);
    result_.scene.objects.push_back(std::move(object));
    result_.motions.push_back(motion);
  }

  std::string unique_name(const std::string& name) {
    std::string unique = name;
    for (int i = 2; !names_.insert(unique).second; ++i) unique = fmt::format("{} ({})", name, i);
    return unique;
  }

  /// Adds the parts that a mover, or nothing, moves. Those that deform become objects of their own.
  void add_mover(int mover, const std::vector<GraphPart>& parts) {
    const SceneMotion at_rest = {{result_.animation.start, {}}};
    const bool moves = mover != kWorld;
    SampledMotion sampled{at_rest};
    std::string name = "world";
    if (moves) {
      sampled = sample_motion(transforms_, static_cast<std::size_t>(mover), Eigen::Matrix4d::Identity());
      name = graph_.nodes[static_cast<std::size_t>(mover)].name;
    }
    const SceneMotion& motion = sampled.rigid ? sampled.motion : at_rest;
    const Eigen::Matrix4d T_object_world = motion.front().T_world_object.inverse().matrix();

    MeshJoiner rigid(file_);
    DeformingMesh scaled(graph_, transforms_, file_);
    for (const GraphPart& part : parts) {
      if (deforms(graph_, transforms_, part)) continue;
      if (sampled.rigid) {
        append_rest(part, T_object_world, rigid);
      } else {
        scaled.append(part);
      }
    }
    if (!rigid.empty() && moves) add(name, rigid.take(materials_), motion, nullptr);
    if (!rigid.empty() && !moves) result_.scene.objects.push_back({name, rigid.take(materials_)});
    if (!scaled.empty()) add_deforming(name, scaled, motion);
    for (const GraphPart& part : parts) {
      if (!deforms(graph_, transforms_, part)) continue;
      DeformingMesh mesh(graph_, transforms_, file_);
      if (sampled.rigid && moves) {
        mesh.append_at(part, T_object_world * transforms_.world(part.node, transforms_.start_s()));
      } else {
        mesh.append(part);
      }
      if (!mesh.empty()) add_deforming(graph_.nodes[part.node].name, mesh, motion);
    }
  }

  void add_deforming(const std::string& name, DeformingMesh& deforming, const SceneMotion& motion) {
    std::shared_ptr<const Deformation> deformation;
    Mesh mesh = deforming.take(deformation);
    add_materials(mesh);
    add(name, std::move(mesh), motion, std::move(deformation));
  }

  void add_cameras(const WarningHandler& warn) {
    for (const GraphCamera& camera : graph_.cameras) {
      SampledMotion sampled = sample_motion(transforms_, camera.node, camera.T_node_camera);
      if (!sampled.rigid) warn(fmt::format("camera {}: its animated scale has no effect", camera.name));
      SceneCamera converted{camera.name, {}, std::move(sampled.motion)};
      if (camera.horizontal_fov_rad > 0) converted.horizontal_fov_rad = camera.horizontal_fov_rad;
      result_.cameras.push_back(std::move(converted));
    }
  }

  const SceneGraph& graph_;
  const std::filesystem::path& file_;
  NodeTransforms transforms_;
  TextureStore textures_;
  Materials materials_;
  SceneFile result_;
  std::set<std::string> names_;
};

}  // namespace

SceneFile flatten(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                  SceneLook look) {
  check_size(graph, file);
  give_warnings(graph, file, warn);
  return Flattener(graph, file, warn, look).objects(warn);
}

SceneObject flatten_joined(const SceneGraph& graph, const std::filesystem::path& file, const WarningHandler& warn,
                           SceneLook look, bool plays) {
  check_size(graph, file);
  give_warnings(graph, file, warn);
  return Flattener(graph, file, warn, look).joined(file.stem().string(), plays);
}

}  // namespace esim::inline scene
