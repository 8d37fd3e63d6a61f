#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <tuple>

#include "esim/core/inputs/used_files.h"
#include "esim/files/input_file.h"
#include "esim/scene/import/folder.h"
#include "esim/scene/import/graph_archive.h"
#include "esim/scene/import/isolated.h"
#include "esim/scene/import/scene_graph.h"
#include "esim/scene/vertices/numbered_mesh.h"

namespace esim::inline scene {
namespace {

/// How the vertices of a mesh get their numbers in the file.
enum class Numbers {
  none,
  places,  ///< they have the order of the file
  colours  ///< as numbered_obj() writes them
};

/// Gives assimp read access to the files of the scene's own folder.
class FolderFiles final : public Assimp::DefaultIOSystem {
 public:
  /// With a `text`, it replaces the content of the scene's file.
  FolderFiles(const std::filesystem::path& file, std::optional<std::string> text)
      : folder_(file.parent_path()), file_(file.string()), text_(std::move(text)) {}

  bool Exists(const char* name) const override { return allowed(name) && DefaultIOSystem::Exists(name); }

  Assimp::IOStream* Open(const char* name, const char* mode) override {
    if (!allowed(name) || mode[0] != 'r') return nullptr;
    note_used(name);
    if (text_ && name == file_)
      return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(text_->data()), text_->size());
    return DefaultIOSystem::Open(name, "rb");
  }

 private:
  bool allowed(const char* name) const {
    std::error_code error;
    const auto relative = std::filesystem::proximate(std::filesystem::weakly_canonical(name, error),
                                                     std::filesystem::weakly_canonical(folder_, error), error);
    return !error && path_inside(folder_, relative.string()).path.has_value();
  }

  std::filesystem::path folder_;
  std::string file_;
  std::optional<std::string> text_;
};

std::string name_of(const aiString& text) {
  std::string name = text.C_Str();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c < 0x20; }, '?');
  return name;
}

Eigen::Matrix4d to_eigen(const aiMatrix4x4& m) {
  Eigen::Matrix4d result;
  result << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, m.d1, m.d2, m.d3, m.d4;
  return result;
}

bool is_finite(const aiVector3D& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Eigen::Vector3d to_eigen(const aiVector3D& v) { return {v.x, v.y, v.z}; }

/// Converts assimp's result to a graph.
class Converter {
 public:
  Converter(const std::filesystem::path& file, std::string format, Numbers numbers, const aiScene& scene)
      : file_(file), format_(std::move(format)), numbers_(numbers), scene_(scene) {}

  SceneGraph convert() {
    read_materials();
    read_meshes();
    read_nodes();
    read_animations();
    read_cameras();
    return std::move(graph_);
  }

 private:
  void warn(const std::string& text) { graph_.warnings.push_back(text); }

  void warn_of_colours(const std::string& name) {
    warn(fmt::format("mesh {}: vertex colours are not supported, and are ignored", name));
  }

  /// The image of a material: embedded in the file, or a separate file.
  std::int32_t image(const std::string& name) {
    const auto [entry, is_new] = image_of_.try_emplace(name, static_cast<std::int32_t>(graph_.images.size()));
    if (!is_new) return entry->second;
    GraphImage image{name, {}};
    if (const aiTexture* const embedded = scene_.GetEmbeddedTexture(name.c_str())) {
      if (embedded->mHeight == 0 && embedded->pcData != nullptr) {
        const auto* const bytes = reinterpret_cast<const std::byte*>(embedded->pcData);
        image.bytes.assign(bytes, bytes + embedded->mWidth);
      } else {
        warn(fmt::format("texture {}: is embedded without compression, which is not supported", name));
      }
    }
    graph_.images.push_back(std::move(image));
    return entry->second;
  }

  GraphTexture texture(const aiMaterial& material, aiTextureType type) {
    aiString name;
    GraphTexture texture;
    if (material.GetTexture(type, 0, &name) != AI_SUCCESS || name.length == 0) return texture;
    texture.image = image(name_of(name));
    int mode = aiTextureMapMode_Wrap;
    const auto wrap = [&] { return mode == aiTextureMapMode_Clamp ? Wrap::clamp : Wrap::repeat; };
    if (material.Get(AI_MATKEY_MAPPINGMODE_U(type, 0), mode) == AI_SUCCESS) texture.wrap_u = wrap();
    if (material.Get(AI_MATKEY_MAPPINGMODE_V(type, 0), mode) == AI_SUCCESS) texture.wrap_v = wrap();
    return texture;
  }

  /// How the material shines, if the file says so; otherwise it is a rough dielectric.
  void read_gloss(const aiMaterial& source, GraphMaterial& material) {
    source.Get(AI_MATKEY_ROUGHNESS_FACTOR, material.roughness);
    source.Get(AI_MATKEY_METALLIC_FACTOR, material.metallic);
    // As with the base colour, a texture alone counts.
    material.roughness_texture = texture(source, aiTextureType_DIFFUSE_ROUGHNESS);
    if (material.roughness_texture.image >= 0) material.roughness = 1;
    material.metallic_texture = texture(source, aiTextureType_METALNESS);
    if (material.metallic_texture.image >= 0) material.metallic = 1;
    material.normal_texture = texture(source, aiTextureType_NORMALS);
    const bool heights = source.GetTextureCount(aiTextureType_HEIGHT) > 0;
    if (material.normal_texture.image >= 0 || heights) ++graph_.relief;
    if (material.normal_texture.image < 0 && heights) ++graph_.bump_maps;
  }

  void read_materials() {
    for (unsigned i = 0; i < scene_.mNumMaterials; ++i) {
      const aiMaterial& source = *scene_.mMaterials[i];
      GraphMaterial material;
      material.name = name_of(source.GetName());
      aiColor3D colour;
      if (source.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS) material.base = {colour.r, colour.g, colour.b};
      // If there is a texture, it alone is the base colour: exporters write an arbitrary factor.
      material.base_texture = texture(source, aiTextureType_DIFFUSE);
      if (material.base_texture.image >= 0) material.base.setOnes();
      if (source.Get(AI_MATKEY_COLOR_EMISSIVE, colour) == AI_SUCCESS)
        material.emission = {colour.r, colour.g, colour.b};
      material.emission_texture = texture(source, aiTextureType_EMISSIVE);
      if (material.emission_texture.image >= 0) material.emission.setOnes();
      read_gloss(source, material);
      int shading = 0;  // none: "illum 0" of MTL, "constant" of Collada
      material.unlit = source.Get(AI_MATKEY_SHADING_MODEL, shading) == AI_SUCCESS && shading == aiShadingMode_NoShading;
      if (!material.base.allFinite() || !material.emission.allFinite())
        fail_scene(file_, fmt::format("a colour of material {} is not finite", material.name));
      if (!std::isfinite(material.roughness) || !std::isfinite(material.metallic))
        fail_scene(file_,
                   fmt::format("the roughness or the metallic factor of material {} is not finite", material.name));
      graph_.materials.push_back(std::move(material));
    }
    if (graph_.materials.empty()) graph_.materials.push_back({.name = "none"});
  }

  void read_meshes() {
    std::size_t vertices = 0, triangles = 0;
    for (unsigned i = 0; i < scene_.mNumMeshes; ++i) {
      const aiMesh& part = *scene_.mMeshes[i];
      vertices += part.mNumVertices, triangles += part.mNumFaces;
      if (vertices > kMaxSceneVertices || triangles > kMaxSceneTriangles)
        fail_scene(file_, fmt::format("has more than {} triangles or {} vertices; simplify it", kMaxSceneTriangles,
                                      kMaxSceneVertices));
      graph_.meshes.push_back(mesh(part));
      if (numbers_ != Numbers::none) graph_.vertex_numbers.push_back(numbers_of(part));
    }
  }

  std::vector<std::uint32_t> numbers_of(const aiMesh& part) const {
    std::vector<std::uint32_t> numbers(part.mNumVertices);
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      numbers[i] = i;
      if (numbers_ == Numbers::places) continue;
      const aiColor4D colour = part.HasVertexColors(0) ? part.mColors[0][i] : aiColor4D();
      const bool sound = colour.r >= 0 && colour.r < kNumberBase && colour.g >= 0 && colour.g < kNumberBase;
      numbers[i] = sound ? static_cast<std::uint32_t>(colour.r) + static_cast<std::uint32_t>(colour.g) * kNumberBase
                         : ~std::uint32_t{0};
    }
    return numbers;
  }

  Mesh mesh(const aiMesh& part) {
    Mesh mesh;
    const std::string name = name_of(part.mName);
    const bool has_normals = part.HasNormals();
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      if (!is_finite(part.mVertices[i])) fail_scene(file_, fmt::format("a vertex of {} is not finite", name));
      mesh.vertices.push_back(to_eigen(part.mVertices[i]).cast<float>());
      if (!has_normals) continue;
      const bool usable = is_finite(part.mNormals[i]);
      mesh.normals.push_back(usable ? Eigen::Vector3f(to_eigen(part.mNormals[i]).cast<float>())
                                    : Eigen::Vector3f::Zero());
    }
    const bool has_material = part.mMaterialIndex < graph_.materials.size();
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // a point or a line
      std::array<std::uint32_t, 3> corners{};
      std::array<Eigen::Vector2f, 3> uv;
      for (unsigned c = 0; c < 3; ++c) {
        const unsigned index = face.mIndices[c];
        if (index >= part.mNumVertices) fail_scene(file_, "is damaged: a face refers to a missing vertex");
        corners[c] = index;
        const aiVector3D coordinate = part.HasTextureCoords(0) ? part.mTextureCoords[0][index] : aiVector3D();
        uv[c] = is_finite(coordinate) ? Eigen::Vector2f(coordinate.x, 1.0F - coordinate.y) : Eigen::Vector2f(0, 0);
      }
      mesh.triangles.push_back(corners);
      mesh.texture_uv.push_back(uv);
      mesh.material.push_back(has_material ? part.mMaterialIndex : 0);
    }
    if (part.HasVertexColors(0) && numbers_ != Numbers::colours) warn_of_colours(name);
    if (part.HasBones())
      warn(fmt::format("mesh {}: skeletons are only read from glTF; it is shown in its rest pose", name));
    if (part.mNumAnimMeshes > 0)
      warn(fmt::format("mesh {}: shape keys are only read from glTF, and are ignored", name));
    return mesh;
  }

  /// The transform from the file's world, as assimp returns it, to metres with z up.
  Eigen::Matrix4d world() const {
    const Eigen::Matrix3d from_y_up =
        Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
    Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
    if (format_ == ".dae") world.topLeftCorner<3, 3>() = from_y_up;
    if (format_ != ".fbx" || scene_.mMetaData == nullptr) return world;
    int up = 1;
    double centimetres = 1;
    scene_.mMetaData->Get("UpAxis", up);
    if (!scene_.mMetaData->Get("UnitScaleFactor", centimetres)) {
      float single = 1;
      if (scene_.mMetaData->Get("UnitScaleFactor", single)) centimetres = double{single};
    }
    if (!std::isfinite(centimetres) || !(centimetres > 0)) centimetres = 1;
    world.topLeftCorner<3, 3>() = (up == 2 ? Eigen::Matrix3d::Identity().eval() : from_y_up) * (0.01 * centimetres);
    return world;
  }

  void read_nodes() {
    graph_.nodes.push_back({.name = "world", .matrix = world()});
    std::vector<std::pair<const aiNode*, int>> to_visit = {{scene_.mRootNode, 0}};
    while (!to_visit.empty()) {
      const auto [source, parent] = to_visit.back();
      to_visit.pop_back();
      if (source == nullptr) continue;
      GraphNode node{.name = name_of(source->mName), .parent = parent, .matrix = to_eigen(source->mTransformation)};
      if (!node.matrix->allFinite()) fail_scene(file_, fmt::format("the pose of {} is not finite", node.name));
      for (unsigned i = 0; i < source->mNumMeshes; ++i) {
        if (source->mMeshes[i] >= graph_.meshes.size())
          fail_scene(file_, "is damaged: a node refers to a missing mesh");
        node.meshes.push_back(source->mMeshes[i]);
      }
      const auto index = static_cast<int>(graph_.nodes.size());
      node_of_.try_emplace(source->mName.C_Str(), index);
      graph_.nodes.push_back(std::move(node));
      for (unsigned i = source->mNumChildren; i-- > 0;) to_visit.emplace_back(source->mChildren[i], index);
    }
  }

  template <class Key>
  Track track(const Key* keys, unsigned count, double ticks_per_second) {
    Track track;
    for (unsigned i = 0; i < count; ++i) {
      const double t_s = keys[i].mTime / ticks_per_second;
      Eigen::Vector4d value;
      if constexpr (std::is_same_v<Key, aiQuatKey>) {
        const aiQuaternion& q = keys[i].mValue;
        value = {q.x, q.y, q.z, q.w};
      } else {
        const aiVector3D& v = keys[i].mValue;
        value = {v.x, v.y, v.z, 0};
      }
      if (!value.allFinite() || !(std::abs(t_s) < 1e6))
        fail_scene(file_, "an animation contains a number that is not finite");
      if (!track.times_s.empty() && !(t_s > track.times_s.back())) continue;  // the same instant twice
      track.times_s.push_back(t_s);
      track.values.push_back(value);
    }
    return track;
  }

  /// A node's motion in one of the file's animations.
  struct Choice {
    const aiAnimation* animation;
    const aiNodeAnim* channel;
    std::string action;  // "Thing|ThingAction" without its first part

    /// Blender's FBX applies every action to every object; an object's own action has its name.
    auto rank(const std::string& node) const {
      return std::tuple(action.starts_with(node), action == "Scene", animation->mNumChannels);
    }
  };

  void read_animations() {
    std::map<int, std::vector<Choice>> choices;
    for (const aiAnimation* const animation : std::span(scene_.mAnimations, scene_.mNumAnimations)) {
      const std::string name = name_of(animation->mName);
      for (const aiNodeAnim* const channel : std::span(animation->mChannels, animation->mNumChannels)) {
        const auto found = node_of_.find(channel->mNodeName.C_Str());
        if (found == node_of_.end() || channel->mNumPositionKeys + channel->mNumRotationKeys == 0) continue;
        choices[found->second].push_back({animation, channel, name.substr(name.rfind('|') + 1)});
      }
    }
    for (const auto& [index, of_node] : choices) {
      GraphNode& node = graph_.nodes[static_cast<std::size_t>(index)];
      const Choice& best = *std::max_element(of_node.begin(), of_node.end(), [&](const Choice& a, const Choice& b) {
        return a.rank(node.name) < b.rank(node.name);
      });
      if (of_node.size() > 1 && !best.action.starts_with(node.name) && best.action != "Scene")
        warn(fmt::format("object {}: has {} animations, of which only {} is shown", node.name, of_node.size(),
                         best.action));
      animate(node, *best.channel, best.animation->mTicksPerSecond > 0 ? best.animation->mTicksPerSecond : 1.0);
    }
  }

  void animate(GraphNode& node, const aiNodeAnim& channel, double ticks_per_second) {
    decompose(node);
    node.translation_track = track(channel.mPositionKeys, channel.mNumPositionKeys, ticks_per_second);
    node.rotation_track = track(channel.mRotationKeys, channel.mNumRotationKeys, ticks_per_second);
    node.scale_track = track(channel.mScalingKeys, channel.mNumScalingKeys, ticks_per_second);
  }

  void decompose(GraphNode& node) const {
    aiMatrix4x4 matrix;
    for (unsigned row = 0; row < 4; ++row) {
      for (unsigned column = 0; column < 4; ++column)
        matrix[row][column] = static_cast<float>((*node.matrix)(static_cast<int>(row), static_cast<int>(column)));
    }
    aiVector3D scale, translation;
    aiQuaternion rotation;
    matrix.Decompose(scale, rotation, translation);
    node.translation = to_eigen(translation);
    node.rotation = Eigen::Quaterniond(rotation.w, rotation.x, rotation.y, rotation.z).normalized();
    node.scale = to_eigen(scale);
    node.matrix.reset();
  }

  void read_cameras() {
    for (unsigned i = 0; i < scene_.mNumCameras; ++i) {
      const aiCamera& source = *scene_.mCameras[i];
      const auto found = node_of_.find(source.mName.C_Str());
      const Eigen::Vector3d forward = to_eigen(source.mLookAt), up = to_eigen(source.mUp);
      const Eigen::Vector3d right = forward.cross(up);
      if (found == node_of_.end() || !(right.norm() > 1e-9) || !right.allFinite() || !is_finite(source.mPosition)) {
        warn(fmt::format("camera {}: has no orientation; it is ignored", name_of(source.mName)));
        continue;
      }
      GraphCamera camera{name_of(source.mName), static_cast<std::uint32_t>(found->second), 0,
                         Eigen::Matrix4d::Identity()};
      camera.T_node_camera.topLeftCorner<3, 3>() << right.normalized(), forward.cross(right).normalized(),
          forward.normalized();
      camera.T_node_camera.topRightCorner<3, 1>() = to_eigen(source.mPosition);
      const double fov_rad = double{source.mHorizontalFOV};
      if (fov_rad > 0 && fov_rad < std::numbers::pi) camera.horizontal_fov_rad = fov_rad;
      graph_.cameras.push_back(std::move(camera));
    }
  }

  std::filesystem::path file_;
  std::string format_;
  Numbers numbers_;
  const aiScene& scene_;
  SceneGraph graph_;
  std::map<std::string, std::int32_t> image_of_;
  std::map<std::string, int> node_of_;
};

SceneGraph read_here(const std::filesystem::path& file, const std::string& format, Numbers numbers) {
  Assimp::Importer importer;
  std::vector<std::string> files;
  const UsedFilesListener listener([&](const UsedFile& used) { files.push_back(used.path.string()); });
  std::optional<std::string> text;
  bool coloured = false;
  if (numbers == Numbers::colours) text = numbered_obj(file, coloured);
  const std::filesystem::path path = std::filesystem::absolute(file);
  importer.SetIOHandler(new FolderFiles(path, std::move(text)));  // which it deletes
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
  unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_TransformUVCoords;
  // It reorders vertices, and joins those in the same place, whatever their numbers are.
  if (numbers == Numbers::none) steps |= aiProcess_JoinIdenticalVertices;
  const aiScene* const scene = importer.ReadFile(path.string(), steps);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    std::string reason = importer.GetErrorString();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    fail_scene(file, "cannot be read: " + reason);
  }
  SceneGraph graph = Converter(file, format, numbers, *scene).convert();
  if (coloured)
    graph.warnings.push_back(
        fmt::format("scene {}: vertex colours are not supported, and are ignored", file.filename().string()));
  graph.files = std::move(files);
  return graph;
}

/// Reads a file in a separate process.
SceneGraph read(const std::filesystem::path& file, Numbers numbers) {
  constexpr std::size_t kMemoryBytes = std::size_t{1} << 30, kMemoryPerByte = 100;
  constexpr unsigned kProcessor_s = 60;
  std::error_code error;
  const auto bytes = static_cast<std::size_t>(std::filesystem::file_size(file, error));
  if (error) fail_scene(file, "cannot be read: " + error.message());
  const std::string format = lower_extension(file);
  const IsolatedResult result =
      run_isolated([&] { return to_bytes(read_here(file, format, numbers)); }, kMemoryBytes + kMemoryPerByte * bytes,
                   kProcessor_s + static_cast<unsigned>(bytes >> 20));
  switch (result.end) {
    case IsolatedResult::End::done: {
      SceneGraph graph = graph_from_bytes(result.bytes);
      for (const std::string& used : graph.files) note_used(used);
      return graph;
    }
    case IsolatedResult::End::refused:
      throw UserError(result.bytes);
    default:
      fail_scene(file, "cannot be read: the parser failed or needed too much memory; export the scene again");
  }
}

}  // namespace

SceneGraph read_with_assimp(const std::filesystem::path& file) { return read(file, Numbers::none); }

SceneGraph read_numbered_with_assimp(const std::filesystem::path& file) {
  return read(file, lower_extension(file) == ".obj" ? Numbers::colours : Numbers::places);
}

}  // namespace esim::inline scene
