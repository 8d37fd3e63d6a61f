#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "esim/scene/import/folder.h"
#include "esim/scene/import/gltf/gltf_animations.h"
#include "esim/scene/import/gltf/gltf_document.h"
#include "esim/scene/import/gltf/gltf_shapes.h"
#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {
namespace {

using Json = GltfDocument::Json;

constexpr std::int32_t kNoMaterial = -1;

Eigen::Vector3f colour_of(const std::vector<double>& factor) {
  return {static_cast<float>(factor[0]), static_cast<float>(factor[1]), static_cast<float>(factor[2])};
}

/// A material's texture and its texture coordinates.
struct TextureSlot {
  GraphTexture texture;
  std::string coordinates = "TEXCOORD_0";
  Eigen::Matrix<float, 2, 3> transform = Eigen::Matrix<float, 2, 3>::Identity();  // KHR_texture_transform
};

class GltfReader {
 public:
  explicit GltfReader(const std::filesystem::path& file) : file_(file), document_(file) {}

  /// `animation`: the name of the one that is played; empty: all.
  SceneGraph read(const std::string& animation) {
    check_extensions();
    graph_.ignores_alpha = true;
    read_images();
    read_materials();
    read_meshes();
    read_nodes();
    read_skins();
    read_gltf_animations(document_, node_of_, animation, graph_);
    return std::move(graph_);
  }

 private:
  void warn(const std::string& text) { graph_.warnings.push_back(text); }

  void check_extensions() {
    static const std::set<std::string> kKnown = {
        "KHR_materials_unlit",        "KHR_materials_emissive_strength", "KHR_texture_transform", "KHR_lights_punctual",
        "KHR_draco_mesh_compression", "EXT_meshopt_compression",         "KHR_mesh_quantization", "EXT_texture_webp",
        "KHR_texture_basisu"};
    for (const Json& extension : document_.list("extensionsRequired")) {
      const std::string name = extension.is_string() ? extension.get<std::string>() : "?";
      if (!kKnown.contains(name) && !name.starts_with("KHR_materials_"))
        document_.fail(
            fmt::format("requires the extension {}, which is not supported; export the scene without it", name));
    }
  }

  void read_images() {
    const Json& images = document_.list("images");
    for (std::size_t i = 0; i < images.size(); ++i) {
      const Json& image = images[i];
      const std::string uri = document_.text(image, "uri");
      GraphImage read{document_.text(image, "name", fmt::format("image {}", i)), {}};
      if (uri.starts_with("data:")) {
        read.bytes = document_.data_uri(uri);
      } else if (!uri.empty()) {
        read.name = percent_decoded(uri);
      } else {
        const auto bytes = document_.buffer_view(document_.index(image, "bufferView", "bufferViews"));
        read.bytes.assign(bytes.begin(), bytes.end());
      }
      graph_.images.push_back(std::move(read));
    }
  }

  /// The image of a texture; -1 if it has none. A WebP image precedes its fallback. An image in Basis Universal is
  /// chosen only if it has no fallback; it cannot be decoded.
  std::int32_t image_of(const Json& texture, const std::string& material) {
    const Json* const extensions = GltfDocument::find(texture, "extensions");
    const auto source = [&](const Json* from) {
      const bool any = from != nullptr && document_.has_index(*from, "source");
      return any ? static_cast<std::int32_t>(document_.index(*from, "source", "images")) : -1;
    };
    const auto extension = [&](const char* name) {
      return source(extensions != nullptr ? GltfDocument::find(*extensions, name) : nullptr);
    };
    if (const std::int32_t webp = extension("EXT_texture_webp"); webp >= 0) return webp;
    if (const std::int32_t plain = source(&texture); plain >= 0) return plain;
    const std::int32_t basis = extension("KHR_texture_basisu");
    if (basis >= 0)
      warn(fmt::format(
          "material {}: its texture is in Basis Universal (KTX2), which is not supported: convert it to PNG, "
          "JPEG or WebP",
          material));
    return basis;
  }

  /// The texture `name` of a part of a material.
  TextureSlot texture_slot(const Json& part, const char* name, const std::string& material) {
    TextureSlot slot;
    const Json* const info = GltfDocument::find(part, name);
    if (info == nullptr) return slot;
    const Json& texture = document_.list("textures")[document_.index(*info, "index", "textures")];
    slot.texture.image = image_of(texture, material);
    if (document_.has_index(texture, "sampler")) {
      constexpr double kClamp = 33071;
      const Json& sampler = document_.list("samplers")[document_.index(texture, "sampler", "samplers")];
      if (document_.number(sampler, "wrapS", 0) == kClamp) slot.texture.wrap_u = Wrap::clamp;
      if (document_.number(sampler, "wrapT", 0) == kClamp) slot.texture.wrap_v = Wrap::clamp;
    }
    slot.coordinates = fmt::format("TEXCOORD_{:.0f}", document_.number(*info, "texCoord", 0));

    const Json* const extensions = GltfDocument::find(*info, "extensions");
    const Json* const moved =
        extensions != nullptr ? GltfDocument::find(*extensions, "KHR_texture_transform") : nullptr;
    if (moved == nullptr) return slot;
    const auto offset = document_.numbers(*moved, "offset", {0, 0}), scale = document_.numbers(*moved, "scale", {1, 1});
    const double angle = document_.number(*moved, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
    Eigen::Matrix<double, 2, 3> transform;
    transform << c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1];
    slot.transform = transform.cast<float>();
    if (GltfDocument::find(*moved, "texCoord") != nullptr)
      slot.coordinates = fmt::format("TEXCOORD_{:.0f}", document_.number(*moved, "texCoord", 0));
    return slot;
  }

  /// All textures of a material are shown with the same coordinates: those of the first one that there is.
  void share_coordinates(const char* what, const TextureSlot& slot, const std::string& material, TextureSlot& first) {
    if (first.texture.image < 0 && slot.texture.image >= 0) first = slot;
    if (slot.texture.image < 0 || (slot.coordinates == first.coordinates && slot.transform == first.transform)) return;
    warn(fmt::format("material {}: its {} texture is shown with the texture coordinates of its base colour", material,
                     what));
  }

  /// How the material shines: pbrMetallicRoughness, normalTexture, KHR_materials_ior and KHR_materials_specular.
  void read_gloss(const Json& json, const Json* extensions, GraphMaterial& material, TextureSlot& first) {
    const auto number = [&](const Json& of, const char* name, double otherwise) {
      return static_cast<float>(document_.number(of, name, otherwise));
    };
    const auto extension = [&](const char* name) {
      return extensions != nullptr ? GltfDocument::find(*extensions, name) : nullptr;
    };
    material.metallic = material.roughness = 1;
    if (const Json* const pbr = GltfDocument::find(json, "pbrMetallicRoughness")) {
      material.metallic = number(*pbr, "metallicFactor", 1), material.roughness = number(*pbr, "roughnessFactor", 1);
      const TextureSlot both = texture_slot(*pbr, "metallicRoughnessTexture", material.name);
      material.metallic_texture = material.roughness_texture = both.texture;
      share_coordinates("roughness", both, material.name, first);
    }
    if (const Json* const normal = GltfDocument::find(json, "normalTexture")) {
      const TextureSlot slot = texture_slot(json, "normalTexture", material.name);
      material.normal_texture = slot.texture, material.normal_scale = number(*normal, "scale", 1);
      share_coordinates("normal", slot, material.name, first);
      ++graph_.relief;
    }
    if (const Json* const ior = extension("KHR_materials_ior")) {
      const float index = number(*ior, "ior", 1.5), ratio = (index - 1) / (index + 1);
      material.reflectance = index > 0 ? ratio * ratio : 1;
    }
    if (const Json* const specular = extension("KHR_materials_specular")) {
      const Eigen::Vector3f colour = colour_of(document_.numbers(*specular, "specularColorFactor", {1, 1, 1}));
      const float strength = number(*specular, "specularFactor", 1), mean = luminance(colour[0], colour[1], colour[2]);
      material.reflectance = strength * std::min(material.reflectance * mean, 1.0F);
      material.edge_reflectance = strength;
      if (GltfDocument::find(*specular, "specularTexture") != nullptr ||
          GltfDocument::find(*specular, "specularColorTexture") != nullptr)
        graph_.gloss_warnings.push_back(fmt::format(
            "material {}: its texture of KHR_materials_specular is not supported, and is ignored", material.name));
    }
  }

  void read_materials() {
    const Json& materials = document_.list("materials");
    for (std::size_t i = 0; i < materials.size(); ++i) {
      const Json& json = materials[i];
      const Json* const extensions = GltfDocument::find(json, "extensions");
      const auto extension = [&](const char* name) {
        return extensions != nullptr ? GltfDocument::find(*extensions, name) : nullptr;
      };
      GraphMaterial material;
      material.name = document_.text(json, "name", fmt::format("material {}", i));
      material.base = Eigen::Vector3f::Ones();
      TextureSlot base;
      if (const Json* const pbr = GltfDocument::find(json, "pbrMetallicRoughness")) {
        material.base = colour_of(document_.numbers(*pbr, "baseColorFactor", {1, 1, 1, 1}));
        base = texture_slot(*pbr, "baseColorTexture", material.name);
        material.base_texture = base.texture;
      }
      material.unlit = extension("KHR_materials_unlit") != nullptr;
      // Baked light can exceed 1, the largest factor of the format.
      if (const Json* const extras = GltfDocument::find(json, "extras"))
        material.base *= static_cast<float>(document_.number(*extras, "esim_radiance_scale", 1));

      material.emission = colour_of(document_.numbers(json, "emissiveFactor", {0, 0, 0}));
      if (const Json* const strength = extension("KHR_materials_emissive_strength"))
        material.emission *= static_cast<float>(document_.number(*strength, "emissiveStrength", 1));
      const TextureSlot emission = texture_slot(json, "emissiveTexture", material.name);
      if (emission.texture.image >= 0) material.emission_texture = emission.texture;
      share_coordinates("emission", emission, material.name, base);
      read_gloss(json, extensions, material, base);
      if (document_.text(json, "alphaMode", "OPAQUE") != "OPAQUE")
        warn(fmt::format("material {}: transparency is not supported; it is shown opaque", material.name));
      graph_.materials.push_back(std::move(material));
      slots_.push_back(std::move(base));
    }
  }

  /// The index of a grey material for surfaces without one.
  std::uint32_t plain_material() {
    if (plain_material_ == kNoMaterial) {
      plain_material_ = static_cast<std::int32_t>(graph_.materials.size());
      graph_.materials.push_back({.name = "none"});
    }
    return static_cast<std::uint32_t>(plain_material_);
  }

  std::size_t accessor_of(const Json& attributes, const char* name) const {
    return document_.index(attributes, name, "accessors");
  }

  /// The corners of a primitive's triangles, as indices of its vertices.
  std::vector<std::uint32_t> corners(const Json& primitive, std::size_t vertices) {
    constexpr double kTriangles = 4, kStrip = 5, kFan = 6;
    const double mode = document_.number(primitive, "mode", kTriangles);
    if (mode != kTriangles && mode != kStrip && mode != kFan) return {};  // points and lines
    std::vector<std::uint32_t> indices;
    if (document_.has_index(primitive, "indices")) {
      indices = document_.integers(document_.index(primitive, "indices", "accessors"));
    } else {
      for (std::uint32_t i = 0; i < vertices; ++i) indices.push_back(i);
    }
    for (const std::uint32_t index : indices) {
      if (index >= vertices) document_.fail("is damaged: a triangle refers to a missing vertex");
    }
    if (mode == kTriangles) {
      indices.resize(indices.size() - indices.size() % 3);
      return indices;
    }
    std::vector<std::uint32_t> result;
    for (std::size_t i = 2; i < indices.size(); ++i) {
      const std::uint32_t first = mode == kFan ? indices[0] : indices[i - 2];
      result.insert(result.end(), {first, indices[i - 1], indices[i]});
    }
    return result;
  }

  void append(Mesh& mesh, GraphShape& shape, const Json& primitive, const std::string& name) {
    const Json* const attributes = GltfDocument::find(primitive, "attributes");
    if (attributes == nullptr || GltfDocument::find(*attributes, "POSITION") == nullptr) return;
    const auto positions = document_.quantised_floats(accessor_of(*attributes, "POSITION"), 3);
    const std::size_t vertices = positions.size() / 3, first = mesh.vertices.size();
    const auto indices = corners(primitive, vertices);
    vertex_count_ += vertices, triangle_count_ += indices.size() / 3;
    if (vertex_count_ > kMaxSceneVertices || triangle_count_ > kMaxSceneTriangles)
      document_.fail(
          fmt::format("has more than {} triangles or {} vertices; simplify it", kMaxSceneTriangles, kMaxSceneVertices));

    const bool has_material = document_.has_index(primitive, "material");
    const std::size_t material = has_material ? document_.index(primitive, "material", "materials") : plain_material();
    const TextureSlot slot = has_material ? slots_[material] : TextureSlot{};

    // Data per vertex.
    for (std::size_t i = 0; i < vertices; ++i)
      mesh.vertices.emplace_back(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
    if (GltfDocument::find(*attributes, "NORMAL") != nullptr) {
      const auto normals = document_.quantised_floats(accessor_of(*attributes, "NORMAL"), 3);
      if (normals.size() != positions.size()) document_.fail("is damaged: a mesh must have one normal per vertex");
      mesh.normals.resize(first, Eigen::Vector3f::Zero());
      for (std::size_t i = 0; i < vertices; ++i)
        mesh.normals.emplace_back(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    } else if (!mesh.normals.empty()) {
      mesh.normals.resize(mesh.vertices.size(), Eigen::Vector3f::Zero());
    }
    std::vector<Eigen::Vector2f> uv(vertices, Eigen::Vector2f::Zero());
    if (GltfDocument::find(*attributes, slot.coordinates.c_str()) != nullptr) {
      const auto coordinates = document_.quantised_floats(accessor_of(*attributes, slot.coordinates.c_str()), 2);
      if (coordinates.size() != 2 * vertices)
        document_.fail("is damaged: a mesh must have one pair of texture coordinates per vertex");
      for (std::size_t i = 0; i < vertices; ++i)
        uv[i] = slot.transform * Eigen::Vector3f(coordinates[2 * i], coordinates[2 * i + 1], 1);
    } else if (slot.texture.image >= 0) {
      warn(fmt::format("mesh {}: has a texture, but its texture coordinates {} are missing", name, slot.coordinates));
    }
    const bool has_normals = GltfDocument::find(*attributes, "NORMAL") != nullptr;
    shapes_.append(primitive, {first, vertices, has_normals}, name, shape);

    // Data per triangle.
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      const auto corner = [&](std::size_t c) { return static_cast<std::uint32_t>(first + indices[i + c]); };
      mesh.triangles.push_back({corner(0), corner(1), corner(2)});
      mesh.texture_uv.push_back({uv[indices[i]], uv[indices[i + 1]], uv[indices[i + 2]]});
      mesh.material.push_back(static_cast<std::uint32_t>(material));
    }
  }

  void read_meshes() {
    for (const Json& json : document_.list("meshes")) {
      Mesh mesh;
      GraphShape shape;
      const Json* const primitives = GltfDocument::find(json, "primitives");
      if (primitives != nullptr && primitives->is_array()) {
        for (const Json& primitive : *primitives)
          append(mesh, shape, primitive, document_.text(json, "name", "without a name"));
      }
      shapes_.finish(json, shape);
      graph_.meshes.push_back(std::move(mesh));
      graph_.shapes.push_back(std::move(shape));
    }
  }

  /// Reads the nodes of the default scene from its roots, so that parents come before their children.
  void read_nodes() {
    GraphNode world{.name = "world"};
    world.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));  // y is up
    graph_.nodes.push_back(std::move(world));

    const Json& nodes = document_.list("nodes");
    node_of_.assign(nodes.size(), -1);
    std::vector<std::pair<std::size_t, int>> to_visit;  // node of the file, parent in the graph
    const auto visit_later = [&](const Json* indices, int parent) {
      if (indices == nullptr || !indices->is_array()) return;
      for (auto child = indices->rbegin(); child != indices->rend(); ++child) {
        if (!child->is_number_unsigned() || child->get<std::uint64_t>() >= nodes.size())
          document_.fail("is damaged: it refers to a missing node");
        to_visit.emplace_back(child->get<std::size_t>(), parent);
      }
    };
    const Json& scenes = document_.list("scenes");
    if (!scenes.empty()) visit_later(GltfDocument::find(scenes[document_.first_scene()], "nodes"), 0);
    while (!to_visit.empty()) {
      const auto [index, parent] = to_visit.back();
      to_visit.pop_back();
      if (node_of_[index] >= 0) document_.fail("is damaged: a node has two parents");
      node_of_[index] = static_cast<int>(graph_.nodes.size());
      graph_.nodes.push_back(node(nodes[index], parent, index));
      visit_later(GltfDocument::find(nodes[index], "children"), node_of_[index]);
    }
  }

  GraphNode node(const Json& json, int parent, std::size_t index) {
    GraphNode node;
    node.name = document_.text(json, "name", fmt::format("node {}", index));
    node.parent = parent;
    if (GltfDocument::find(json, "matrix") != nullptr) {
      const auto columns = document_.numbers(json, "matrix", std::vector<double>(16));
      node.matrix = Eigen::Map<const Eigen::Matrix4d>(columns.data());
      if (node.matrix->row(3) != Eigen::RowVector4d::UnitW())
        document_.fail("is damaged: the matrix of a node is not affine");
    } else {
      const auto t = document_.numbers(json, "translation", {0, 0, 0});
      const auto r = document_.numbers(json, "rotation", {0, 0, 0, 1}), s = document_.numbers(json, "scale", {1, 1, 1});
      node.translation = {t[0], t[1], t[2]};
      node.rotation = Eigen::Quaterniond(r[3], r[0], r[1], r[2]);
      if (!(node.rotation.norm() > 1e-6)) document_.fail("is damaged: a node's rotation is zero");
      node.rotation.normalize();
      node.scale = {s[0], s[1], s[2]};
    }
    if (document_.has_index(json, "mesh"))
      node.meshes.push_back(static_cast<std::uint32_t>(document_.index(json, "mesh", "meshes")));
    if (document_.has_index(json, "skin"))
      skinned_.emplace_back(graph_.nodes.size(), document_.index(json, "skin", "skins"));
    if (document_.has_index(json, "weights") && !node.meshes.empty()) {
      const std::size_t targets = graph_.shapes[node.meshes.front()].targets.size();
      const auto weights = document_.numbers(json, "weights", std::vector<double>(targets));
      node.weights.assign(weights.begin(), weights.end());
    }
    if (document_.has_index(json, "camera")) read_camera(json, node.name);
    return node;
  }

  /// Cameras look along -z, with y up. They belong to the node that is added next.
  void read_camera(const Json& node, const std::string& name) {
    const Json& json = document_.list("cameras")[document_.index(node, "camera", "cameras")];
    GraphCamera camera{name, static_cast<std::uint32_t>(graph_.nodes.size()), 0, Eigen::Matrix4d::Identity()};
    camera.T_node_camera.diagonal() = Eigen::Vector4d(1, -1, -1, 1);
    if (const Json* const perspective = GltfDocument::find(json, "perspective")) {
      const double vertical_rad = document_.number(*perspective, "yfov", 0);
      const double aspect = document_.number(*perspective, "aspectRatio", 0);
      if (vertical_rad > 0 && vertical_rad < std::numbers::pi && aspect > 0)
        camera.horizontal_fov_rad = 2 * std::atan(aspect * std::tan(vertical_rad / 2));
    } else {
      warn(fmt::format("camera {}: is orthographic, which is not supported; its images will be perspective", name));
    }
    graph_.cameras.push_back(std::move(camera));
  }

  /// The skins of the scene's nodes.
  void read_skins() {
    std::map<std::size_t, int> skin_of;  // of the graph, per skin of the file
    for (const auto& [node, skin] : skinned_) {
      const auto [known, is_new] = skin_of.try_emplace(skin, static_cast<int>(graph_.skins.size()));
      if (is_new) graph_.skins.push_back(shapes_.skin(skin, node_of_));
      graph_.nodes[node].skin = known->second;
    }
    shapes_.check(graph_);
  }

  std::filesystem::path file_;
  GltfDocument document_;
  SceneGraph graph_;
  std::vector<TextureSlot> slots_;  // of the base colours, per material
  std::vector<int> node_of_;        // of the graph, per node of the file; -1: not in the scene
  std::int32_t plain_material_ = kNoMaterial;
  std::size_t vertex_count_ = 0, triangle_count_ = 0;
  GltfShapes shapes_{document_, graph_.warnings};
  std::vector<std::pair<std::size_t, std::size_t>> skinned_;  // nodes of the graph, skins of the file
};

}  // namespace

SceneGraph read_gltf(const std::filesystem::path& file, const std::string& animation) {
  return GltfReader(file).read(animation);
}

}  // namespace esim::inline scene
