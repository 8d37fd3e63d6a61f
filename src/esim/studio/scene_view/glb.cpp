#include "esim/studio/scene_view/glb.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <unordered_map>

#include "esim/core/error.h"
#include "esim/studio/scene_view/coarse.h"
#include "esim/studio/scene_view/page_images.h"
#include "esim/studio/server/json.h"

namespace esim::studio {
namespace {

constexpr int kThumbnail = 128;  // px
// Constants of glTF: number types, buffer targets, texture wrapping.
constexpr int kUint32 = 5125, kFloat = 5126, kVertices = 34962, kIndices = 34963, kClamp = 33071, kRepeat = 10497;
// Number of triangles that a browser without a graphics card draws ten times a second, in the view and in the camera's.
constexpr std::size_t kFewTriangles = 100'000, kCoarseTriangles = 24'000;
constexpr std::uint32_t kNone = ~0U;
constexpr double kMissingTexture = 0.2;  // as esim shows it

/// A material in three colour channels.
PerColour<const Material*> in_colour(const Mesh& mesh, std::size_t index) {
  PerColour<const Material*> channels{};
  for (std::size_t c = 0; c < channels.size(); ++c) channels[c] = &mesh.coloured[c][index];
  return channels;
}

/// A base colour or an emission: a factor and a texture, which may be null.
struct Look {
  PerColour<double> factor{};
  const CodedTexture* texture = nullptr;
};

Look base_of(const PerColour<const Material*>& material) {
  Look look;
  for (std::size_t c = 0; c < 3; ++c) look.factor[c] = material[c]->base;
  look.texture = material[0]->coded.get();
  return look;
}

Look emission_of(const PerColour<const Material*>& material) {
  Look look;
  for (std::size_t c = 0; c < 3; ++c) look.factor[c] = material[c]->emission;
  look.texture = material[0]->coded_emission.get();
  return look;
}

/// All textures of a material; some may be null.
std::array<std::shared_ptr<const CodedTexture>, 5> textures_of(const Material& material) {
  const Gloss none, &gloss = material.gloss ? *material.gloss : none;
  return {material.coded, material.coded_emission, gloss.coded_roughness, gloss.coded_metallic, gloss.coded_normals};
}

bool is_dark(const Look& look) {
  return std::all_of(look.factor.begin(), look.factor.end(), [](double f) { return f <= 0; });
}

class Writer {
 public:
  Writer(const Scene& scene, const Workers& workers) : lit_(scene.lighting.has_value()) {
    make_thumbnails(scene, workers);
    for (const SceneObject& object : scene.objects) triangles_ += object.mesh.triangles.size();
    for (const SceneObject& object : scene.objects) add(object);
    if (any_unlit_) gltf_["extensionsUsed"] = {"KHR_materials_unlit"};
  }

  Glb finish() {
    gltf_["scenes"] = Json::array({{{"nodes", roots_}}});
    gltf_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
    std::string json = text_of(gltf_);
    json.resize((json.size() + 3) / 4 * 4, ' ');
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    constexpr std::size_t kHeads = 12 + 8 + 8;
    const std::size_t size = kHeads + json.size() + binary_.size();
    if (size > std::numeric_limits<std::uint32_t>::max())
      throw UserError("the scene is too large for a browser; GLB is limited to 4 GiB");
    std::string bytes = "glTF";
    const auto put = [&](std::size_t value) {
      for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift & 0xff);
    };
    put(2), put(size);
    put(json.size()), bytes += "JSON" + json;
    put(binary_.size()), bytes += std::string("BIN\0", 4) + binary_;
    return {std::move(bytes), std::move(names_), std::move(images_)};
  }

 private:
  /// Makes all thumbnails in parallel, since this takes the most time.
  void make_thumbnails(const Scene& scene, const Workers& workers) {
    std::vector<std::shared_ptr<const CodedTexture>> all;
    for (const SceneObject& object : scene.objects) {
      for (const Material& material : object.mesh.coloured[0]) {
        for (const auto& texture : textures_of(material)) {
          if (texture != nullptr && textures_.try_emplace(texture.get()).second) all.push_back(texture);
        }
      }
    }
    std::vector<std::optional<Thumbnail>> made(all.size());
    workers.for_each(static_cast<int>(all.size()), [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      try {
        made[i] = thumbnail(*all[i], kThumbnail);
      } catch (const UserError&) {  // the renderer will report it
      }
    });
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (made[i]) textures_[all[i].get()] = add_texture(all[i], *made[i]);
    }
  }

  void add(const SceneObject& object) {
    const std::string name = fmt::format("object_{}", names_.size());
    names_.push_back(name);
    Json node{{"name", name}};
    if (!object.mesh.triangles.empty()) {
      Json primitives = primitives_of(object);
      node["mesh"] = gltf_["meshes"].size();
      gltf_["meshes"].push_back({{"primitives", std::move(primitives)}});
    }
    roots_.push_back(gltf_["nodes"].size());
    gltf_["nodes"].push_back(std::move(node));
  }

  /// One primitive per material.
  Json primitives_of(const SceneObject& object) {
    const Mesh& mesh = object.mesh;
    std::map<std::uint32_t, std::vector<std::uint32_t>> triangles;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) triangles[mesh.material[i]].push_back(i);
    Json primitives = Json::array();
    std::vector<std::uint32_t> first_of(mesh.vertices.size(), kNone);
    for (const auto& [material, of] : triangles) {
      Json primitive = geometry(object, of, first_of);
      for (const std::uint32_t triangle : of) {
        for (const std::uint32_t vertex : mesh.triangles[triangle]) first_of[vertex] = kNone;
      }
      primitive["material"] = material_of(mesh, material);
      primitives.push_back(std::move(primitive));
    }
    return primitives;
  }

  /// Corners of triangles share a vertex unless their texture coordinates differ. `first_of` must be empty for each of
  /// the mesh's vertices.
  Json geometry(const SceneObject& object, const std::vector<std::uint32_t>& triangles,
                std::vector<std::uint32_t>& first_of) {
    const Mesh& mesh = object.mesh;
    struct Corner {
      std::uint32_t vertex;
      float u, v;
      bool operator==(const Corner&) const = default;
    };
    struct Hash {
      std::size_t operator()(const Corner& c) const {
        std::uint32_t u = 0, v = 0;
        std::memcpy(&u, &c.u, sizeof u), std::memcpy(&v, &c.v, sizeof v);
        return (c.vertex * 0x9e3779b97f4a7c15U) ^ (u * 0xc2b2ae3d27d4eb4fU) ^ (std::uint64_t{v} << 20);
      }
    };
    const bool shaded = lit_ && mesh.normals.size() == mesh.vertices.size();
    std::unordered_map<Corner, std::uint32_t, Hash> others;
    std::vector<float> positions, normals, uvs;
    std::vector<std::uint32_t> indices, vertices;
    indices.reserve(3 * triangles.size());
    const auto index_of = [&](const Corner& corner) {
      const auto next = static_cast<std::uint32_t>(positions.size() / 3);
      std::uint32_t& first = first_of[corner.vertex];
      if (first == kNone) return first = next;
      if (uvs[2 * first] == corner.u && uvs[2 * first + 1] == corner.v) return first;
      return others.try_emplace(corner, next).first->second;
    };
    for (const std::uint32_t triangle : triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector2f& uv = mesh.texture_uv[triangle][k];
        const Corner corner{mesh.triangles[triangle][k], uv.x() + 0.0F, uv.y() + 0.0F};
        indices.push_back(index_of(corner));
        const bool is_new = indices.back() == positions.size() / 3;
        if (!is_new) continue;
        vertices.push_back(corner.vertex);
        const Eigen::Vector3f& at = mesh.vertices[corner.vertex];
        positions.insert(positions.end(), {at.x(), at.y(), at.z()});
        uvs.insert(uvs.end(), {uv.x(), uv.y()});
        if (!shaded) continue;
        Eigen::Vector3f n = mesh.normals[corner.vertex];
        n = n.norm() > 0 ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f::UnitZ();
        normals.insert(normals.end(), {n.x(), n.y(), n.z()});
      }
    }
    Json attributes{{"POSITION", accessor(positions, "VEC3", kFloat, kVertices)},
                    {"TEXCOORD_0", accessor(uvs, "VEC2", kFloat, kVertices)}};
    if (shaded) attributes["NORMAL"] = accessor(normals, "VEC3", kFloat, kVertices);
    add_bounds(positions, gltf_["accessors"][attributes["POSITION"].get<std::size_t>()]);
    Json primitive{{"attributes", attributes}, {"indices", accessor(indices, "SCALAR", kUint32, kIndices)}};
    if (triangles_ > kFewTriangles) {
      const std::size_t share = kCoarseTriangles * triangles.size() / triangles_;
      const std::vector<std::uint32_t> coarse = coarse_indices({positions, uvs, indices}, share);
      if (!coarse.empty()) primitive["extras"]["coarse"] = accessor(coarse, "SCALAR", kUint32, kIndices);
    }
    if (object.deformation) primitive["extras"]["vertices"] = accessor(vertices, "SCALAR", kUint32, std::nullopt);
    return primitive;
  }

  static void add_bounds(const std::vector<float>& positions, Json& accessor) {
    Eigen::AlignedBox3f box;
    for (std::size_t i = 0; i < positions.size(); i += 3) box.extend(Eigen::Map<const Eigen::Vector3f>(&positions[i]));
    accessor["min"] = {box.min().x(), box.min().y(), box.min().z()};
    accessor["max"] = {box.max().x(), box.max().y(), box.max().z()};
  }

  template <typename T>
  std::size_t accessor(const std::vector<T>& numbers, const char* type, int component, std::optional<int> target) {
    const std::size_t per_item = std::strcmp(type, "SCALAR") == 0 ? 1 : static_cast<std::size_t>(type[3] - '0');
    const auto view = add_view({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)}, target);
    gltf_["accessors"].push_back(
        {{"bufferView", view}, {"componentType", component}, {"count", numbers.size() / per_item}, {"type", type}});
    return gltf_["accessors"].size() - 1;
  }

  std::size_t add_view(std::string_view bytes, std::optional<int> target) {
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    Json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
    if (target) view["target"] = *target;
    binary_ += bytes;
    gltf_["bufferViews"].push_back(std::move(view));
    return gltf_["bufferViews"].size() - 1;
  }

  std::size_t material_of(const Mesh& mesh, std::uint32_t index) {
    const auto channels = in_colour(mesh, index);
    const auto [entry, is_new] = materials_.try_emplace(channels, gltf_["materials"].size());
    if (!is_new) return entry->second;
    const bool unlit = !lit_ || channels[0]->unlit;
    any_unlit_ = any_unlit_ || unlit;
    Look base = base_of(channels), emission = emission_of(channels);
    if (unlit && is_dark(base)) std::swap(base, emission);
    Json surface{{"baseColorFactor", factor(base, 1)}, {"metallicFactor", 0}, {"roughnessFactor", 1}};
    Json material{{"name", mesh.materials[index].name}, {"doubleSided", true}};
    if (channels[0]->gloss && !unlit) add_gloss(*channels[0]->gloss, surface, material);
    if (const auto texture = texture_of(base.texture)) {
      surface["baseColorTexture"] = {{"index", *texture}};
    } else if (base.texture != nullptr) {
      base.factor.fill(kMissingTexture);
      surface["baseColorFactor"] = factor(base, 1);
    }
    material["pbrMetallicRoughness"] = surface;
    if (unlit) material["extensions"] = {{"KHR_materials_unlit", Json::object()}};
    if (!unlit && !is_dark(emission)) {
      material["emissiveFactor"] = factor(emission, std::nullopt);
      if (const auto texture = texture_of(emission.texture)) material["emissiveTexture"] = {{"index", *texture}};
    }
    gltf_["materials"].push_back(std::move(material));
    return entry->second;
  }

  /// glTF has one texture for roughness and metallic factor: two different files are left out.
  void add_gloss(const Gloss& gloss, Json& surface, Json& material) const {
    surface["metallicFactor"] = gloss.metallic;
    surface["roughnessFactor"] = gloss.roughness;
    const bool one = gloss.coded_metallic == gloss.coded_roughness || gloss.metallic == 0;
    if (const auto texture = one ? texture_of(gloss.coded_roughness.get()) : std::nullopt)
      surface["metallicRoughnessTexture"] = {{"index", *texture}};
    if (const auto texture = texture_of(gloss.coded_normals.get()))
      material["normalTexture"] = {{"index", *texture}, {"scale", gloss.normal_scale}};
  }

  static Json factor(const Look& look, std::optional<double> alpha) {
    Json numbers = Json::array();
    for (const double value : look.factor) numbers.push_back(std::clamp(value, 0.0, 1.0));
    if (alpha) numbers.push_back(*alpha);
    return numbers;
  }

  std::optional<std::size_t> texture_of(const CodedTexture* texture) const {
    return texture == nullptr ? std::nullopt : textures_.at(texture);
  }

  std::size_t add_texture(const std::shared_ptr<const CodedTexture>& texture, const Thumbnail& thumbnail) {
    const std::size_t view = add_view(thumbnail.jpeg, std::nullopt);
    const auto wrap = [](Wrap w) { return w == Wrap::repeat ? kRepeat : kClamp; };
    Json image{{"bufferView", view}, {"mimeType", "image/jpeg"}};
    if (!thumbnail.whole) image["extras"] = {{"image", images_.size()}};
    gltf_["images"].push_back(std::move(image));
    gltf_["samplers"].push_back({{"wrapS", wrap(texture->wrap_u)}, {"wrapT", wrap(texture->wrap_v)}});
    const std::size_t index = gltf_["textures"].size();
    gltf_["textures"].push_back({{"source", index}, {"sampler", index}});
    images_.push_back(texture);
    return index;
  }

  bool lit_, any_unlit_ = false;
  std::size_t triangles_ = 0;
  Json gltf_{{"asset", {{"version", "2.0"}, {"generator", "esim"}}}, {"scene", 0}};
  std::string binary_;
  Json roots_ = Json::array();
  std::vector<std::string> names_;
  std::map<PerColour<const Material*>, std::size_t> materials_;
  std::map<const CodedTexture*, std::optional<std::size_t>> textures_;  // empty if it cannot be decoded
  std::vector<std::shared_ptr<const CodedTexture>> images_;
};

}  // namespace

Glb make_glb(const Scene& scene, const Workers& workers) { return Writer(scene, workers).finish(); }

}  // namespace esim::studio
