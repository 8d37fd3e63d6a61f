// The compressed parts of glTF files: they are decoded to buffers that are added to the document, whose accessors and
// views are changed to refer to these.
#include <fmt/format.h>
#include <meshoptimizer.h>

#include <utility>

#include "esim/scene/import/gltf/draco_mesh.h"
#include "esim/scene/import/gltf/gltf_document.h"
#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {
namespace {

using Json = GltfDocument::Json;

constexpr const char* kMeshopt = "EXT_meshopt_compression";
constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr std::size_t kMaxDecodedBytes = std::size_t{1} << 29;

const Json* extension(const Json& object, const char* name) {
  const Json* const extensions = GltfDocument::find(object, "extensions");
  return extensions == nullptr ? nullptr : GltfDocument::find(*extensions, name);
}

/// A bufferView that meshoptimizer compressed.
struct MeshoptView {
  std::size_t count = 0, stride = 0;
  std::string mode, filter;
};

/// What is wrong with the numbers of a view; empty if nothing. The decoder relies on them.
std::string fault(const MeshoptView& view, std::size_t compressed_bytes) {
  // 16 values take at least 2 bits (attributes), three indices at least a byte, and a view has a short tail.
  constexpr std::size_t kRatio = 64, kTail = 1 << 16;
  const bool attributes = view.mode == "ATTRIBUTES", triangles = view.mode == "TRIANGLES";
  if (!attributes && !triangles && view.mode != "INDICES") return "has an unknown mode";
  if (attributes ? view.stride == 0 || view.stride > 256 || view.stride % 4 != 0 : view.stride != 2 && view.stride != 4)
    return "has an invalid byteStride";
  if (triangles && view.count % 3 != 0) return "has an incomplete triangle";
  if (view.count > (kRatio * compressed_bytes + kTail) / view.stride) return "is cut off";
  if (view.filter == "NONE") return {};
  if (!attributes) return "has a filter, but contains indices";
  if (view.filter == "OCTAHEDRAL") return view.stride == 4 || view.stride == 8 ? "" : "has an invalid byteStride";
  if (view.filter == "QUATERNION") return view.stride == 8 ? "" : "has an invalid byteStride";
  return view.filter == "EXPONENTIAL" ? "" : "has an unknown filter";
}

/// Whether the bytes can be decoded.
bool decode(const MeshoptView& view, std::span<const std::byte> from, std::vector<std::byte>& to) {
  to.resize(view.count * view.stride);
  if (view.count == 0) return true;
  const auto* const bytes = reinterpret_cast<const unsigned char*>(from.data());
  const int failed =
      view.mode == "ATTRIBUTES"  ? meshopt_decodeVertexBuffer(to.data(), view.count, view.stride, bytes, from.size())
      : view.mode == "TRIANGLES" ? meshopt_decodeIndexBuffer(to.data(), view.count, view.stride, bytes, from.size())
                                 : meshopt_decodeIndexSequence(to.data(), view.count, view.stride, bytes, from.size());
  if (failed != 0) return false;
  if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(to.data(), view.count, view.stride);
  if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(to.data(), view.count, view.stride);
  if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(to.data(), view.count, view.stride);
  return true;
}

/// The integer that stands for 1 in an accessor; 1 if its integers are not normalised.
float unit_of(const Json& accessor) {
  const Json *const normalised = GltfDocument::find(accessor, "normalized"), *const type = GltfDocument::find(
                                                                                 accessor, "componentType");
  if (normalised == nullptr || *normalised != true || type == nullptr) return 1;
  return *type == 5120 ? 127.0F : *type == 5121 ? 255.0F : *type == 5122 ? 32767.0F : *type == 5123 ? 65535.0F : 1.0F;
}

template <typename T>
std::vector<std::byte> as_bytes(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

bool GltfDocument::is_fallback(const Json& buffer) { return extension(buffer, kMeshopt) != nullptr; }

std::size_t GltfDocument::add_buffer(std::vector<std::byte> bytes) {
  decoded_bytes_ += bytes.size();
  if (decoded_bytes_ > kMaxDecodedBytes)
    fail(fmt::format("needs more than {} bytes when it is decompressed; simplify it", kMaxDecodedBytes));
  root_["buffers"].push_back({{"byteLength", bytes.size()}});
  buffers_.push_back(std::move(bytes));
  return buffers_.size() - 1;
}

void GltfDocument::decode_meshopt() {
  const std::size_t count = list("bufferViews").size();
  for (std::size_t i = 0; i < count; ++i) {
    const Json* const json = extension(list("bufferViews")[i], kMeshopt);
    if (json == nullptr) continue;
    const MeshoptView view{whole(*json, "count", 0), whole(*json, "byteStride", 0), text(*json, "mode"),
                           text(*json, "filter", "NONE")};
    const std::span<const std::byte> bytes = bytes_of(*json, fmt::format("bufferView {}", i));
    const std::string wrong = fault(view, bytes.size());
    if (!wrong.empty()) fail(fmt::format("is damaged: the compressed bufferView {} {}", i, wrong));
    std::vector<std::byte> decoded;
    if (!decode(view, bytes, decoded)) fail(fmt::format("is damaged: bufferView {} cannot be decompressed", i));
    const std::size_t length = decoded.size(), buffer = add_buffer(std::move(decoded));
    Json& changed = root_["bufferViews"][i];
    changed = {{"buffer", buffer}, {"byteOffset", std::size_t{0}}, {"byteLength", length}};
    if (view.mode == "ATTRIBUTES") changed["byteStride"] = view.stride;
  }
}

void GltfDocument::decode_draco_meshes() {
  const std::size_t meshes = list("meshes").size();
  for (std::size_t i = 0; i < meshes; ++i) {
    const Json* const primitives = find(list("meshes")[i], "primitives");
    const std::size_t count = primitives != nullptr && primitives->is_array() ? primitives->size() : 0;
    for (std::size_t k = 0; k < count; ++k) {
      Json& primitive = root_["meshes"][i]["primitives"][k];
      if (const Json* const json = extension(primitive, kDraco)) decode_primitive(Json(*json), primitive);
    }
  }
}

void GltfDocument::decode_primitive(const Json& json, Json& primitive) {
  const Json *const ids = find(json, "attributes"), *const accessors = find(primitive, "attributes");
  if (ids == nullptr || accessors == nullptr || !ids->is_object() || !accessors->is_object())
    fail("is damaged: a mesh compressed by Draco has no attributes");
  std::vector<std::size_t> targets;  // accessors
  std::vector<DracoAttribute> wanted;
  for (const auto& [name, id] : ids->items()) {
    if (find(*accessors, name.c_str()) == nullptr) continue;
    const std::size_t target = index(*accessors, name.c_str(), "accessors");
    targets.push_back(target);
    wanted.push_back({static_cast<std::uint32_t>(whole(*ids, name.c_str(), 0)), components_of(target),
                      name.starts_with("JOINTS_"), unit_of(list("accessors")[target])});
    if (wanted.back().components == 0) fail(fmt::format("is damaged: accessor {} has no type", target));
  }
  const std::size_t view = index(json, "bufferView", "bufferViews");
  DracoMesh mesh = decode_draco(file_, buffer_view(view), wanted, kMaxDecodedBytes - decoded_bytes_);

  const auto replace = [&](Json& accessor, std::vector<std::byte> bytes, std::size_t type, std::size_t count) {
    const std::size_t length = bytes.size(), buffer = add_buffer(std::move(bytes));
    root_["bufferViews"].push_back({{"buffer", buffer}, {"byteOffset", std::size_t{0}}, {"byteLength", length}});
    accessor["bufferView"] = root_["bufferViews"].size() - 1;
    accessor["componentType"] = type;
    accessor["count"] = count;
    accessor["normalized"] = false;
    accessor.erase("byteOffset");
  };
  constexpr std::size_t kUnsignedInt = 5125, kFloat = 5126;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    replace(root_["accessors"][targets[i]], std::move(mesh.attributes[i]), wanted[i].whole ? kUnsignedInt : kFloat,
            mesh.vertices);
  Json indices = {{"type", "SCALAR"}};
  replace(indices, as_bytes(mesh.indices), kUnsignedInt, mesh.indices.size());
  root_["accessors"].push_back(std::move(indices));
  primitive["indices"] = root_["accessors"].size() - 1;
  primitive["mode"] = 4;  // triangles
  primitive["extensions"].erase(kDraco);
}

}  // namespace esim::inline scene
