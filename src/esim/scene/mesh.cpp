#include "esim/scene/mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <map>

#include "esim/core/error.h"
#include "esim/scene/image_file.h"

namespace esim {
namespace {

constexpr float kMissingTextureBase = 0.2F;  // a mid-grey surface: 18-20 % reflectance

/// Loads each texture file once.
class TextureCache {
 public:
  TextureCache(std::filesystem::path folder, const WarningHandler& warn) : folder_(std::move(folder)), warn_(warn) {}

  /// Null, after a warning, when the file is missing or unreadable.
  std::shared_ptr<const Texture> get(std::string name, const std::string& material) {
    std::replace(name.begin(), name.end(), '\\', '/');
    const auto [entry, is_new] = textures_.try_emplace(name);
    if (is_new) {
      try {
        entry->second = std::make_shared<const Texture>(load_luminance(folder_ / name), Wrap::repeat, Wrap::repeat);
      } catch (const UserError& error) {
        warn_(fmt::format("material {}: {}; its surfaces are grey", material, error.what()));
      }
    }
    return entry->second;
  }

 private:
  std::filesystem::path folder_;
  const WarningHandler& warn_;
  std::map<std::string, std::shared_ptr<const Texture>> textures_;
};

Material convert(const aiMaterial& source, TextureCache& textures) {
  Material material;
  material.name = source.GetName().C_Str();
  aiString file;
  if (source.GetTexture(aiTextureType_DIFFUSE, 0, &file) == AI_SUCCESS) {
    material.texture = textures.get(file.C_Str(), material.name);
    material.base = material.texture != nullptr ? 1.0F : kMissingTextureBase;
    return material;
  }
  aiColor3D colour(0.5F, 0.5F, 0.5F);
  source.Get(AI_MATKEY_COLOR_DIFFUSE, colour);
  material.base = luminance(colour.r, colour.g, colour.b);
  return material;
}

bool is_finite(const aiVector3D& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void append(Mesh& mesh, const aiMesh& part, const std::filesystem::path& path) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    if (!is_finite(v))
      throw UserError(fmt::format("mesh {}: a vertex of {} is not finite", path.string(), part.mName.C_Str()));
    mesh.vertices.emplace_back(v.x, v.y, v.z);
    const aiVector3D n = part.HasNormals() && is_finite(part.mNormals[i]) ? part.mNormals[i] : aiVector3D();
    mesh.normals.emplace_back(n.x, n.y, n.z);
  }
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    if (face.mNumIndices != 3) continue;
    std::array<std::uint32_t, 3> corners{};
    std::array<Eigen::Vector2f, 3> uv;
    for (unsigned c = 0; c < 3; ++c) {
      const unsigned index = face.mIndices[c];
      if (index >= part.mNumVertices)
        throw UserError(fmt::format("mesh {}: a face names a vertex that is not there", path.string()));
      corners[c] = first + index;
      const aiVector3D coordinate = part.HasTextureCoords(0) ? part.mTextureCoords[0][index] : aiVector3D();
      uv[c] = is_finite(coordinate) ? Eigen::Vector2f(coordinate.x, 1.0F - coordinate.y) : Eigen::Vector2f(0, 0);
    }
    mesh.triangles.push_back(corners);
    mesh.texture_uv.push_back(uv);
    mesh.material.push_back(part.mMaterialIndex);
  }
}

}  // namespace

Mesh load_mesh(const std::filesystem::path& path, const WarningHandler& warn) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw UserError(fmt::format("mesh {}: no such file", path.string()));
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_JoinIdenticalVertices |
                                           aiProcess_PreTransformVertices);
  if (scene == nullptr)
    throw UserError(fmt::format("mesh {}: cannot be read: {}", path.string(), importer.GetErrorString()));

  Mesh mesh;
  TextureCache textures(path.parent_path(), warn);
  for (unsigned i = 0; i < scene->mNumMaterials; ++i)
    mesh.materials.push_back(convert(*scene->mMaterials[i], textures));
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) append(mesh, *scene->mMeshes[i], path);
  if (mesh.triangles.empty()) throw UserError(fmt::format("mesh {}: holds no triangles", path.string()));
  return mesh;
}

}  // namespace esim
