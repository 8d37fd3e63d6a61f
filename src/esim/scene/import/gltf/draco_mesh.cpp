#include "esim/scene/import/gltf/draco_mesh.h"

#include <draco/compression/decode.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "esim/core/error.h"
#include "esim/scene/import/isolated.h"
#include "esim/scene/import/scene_graph.h"

namespace esim::inline scene {
namespace {

template <typename T>
void put(const T& value, std::string& bytes) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

float normalised(float value, float unit) { return std::max(value / unit, -1.0F); }
std::uint32_t normalised(std::uint32_t value, float) { return value; }

template <typename T>
void put_values(const draco::Mesh& mesh, const draco::PointAttribute& from, const DracoAttribute& attribute,
                std::string& bytes) {
  const std::size_t components = attribute.components;
  std::vector<T> values(components);
  const bool normalises = !attribute.whole && attribute.unit != 1 && !from.normalized() &&
                          from.data_type() != draco::DT_FLOAT32 && from.data_type() != draco::DT_FLOAT64;
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    if (!from.ConvertValue<T>(from.mapped_index(point), static_cast<std::int8_t>(components), values.data()))
      throw UserError("has an attribute of a type that does not fit");
    for (const T value : values) put(normalises ? normalised(value, attribute.unit) : value, bytes);
  }
}

/// The mesh as bytes: the numbers of vertices and triangles, the triangles, the attributes.
std::string decoded(std::span<const std::byte> bytes, const std::vector<DracoAttribute>& attributes,
                    std::size_t max_bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  auto result = draco::Decoder().DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) throw UserError(fmt::format("cannot be decoded ({})", result.status().error_msg_string()));
  const draco::Mesh& mesh = *result.value();
  std::size_t components = 0;
  for (const DracoAttribute& attribute : attributes) components += attribute.components;
  const std::size_t vertices = mesh.num_points(), triangles = mesh.num_faces();
  if (vertices * components * sizeof(float) + triangles * 3 * sizeof(std::uint32_t) > max_bytes)
    throw UserError("is too large when it is decoded");

  std::string text;
  put(vertices, text), put(triangles, text);
  for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face) {
    for (const draco::PointIndex& point : mesh.face(face)) put(point.value(), text);
  }
  for (const DracoAttribute& attribute : attributes) {
    const draco::PointAttribute* const from = mesh.GetAttributeByUniqueId(attribute.id);
    if (from == nullptr || static_cast<std::size_t>(from->num_components()) != attribute.components)
      throw UserError(
          fmt::format("has no attribute {} of {} components per vertex", attribute.id, attribute.components));
    if (attribute.whole) {
      put_values<std::uint32_t>(mesh, *from, attribute, text);
    } else {
      put_values<float>(mesh, *from, attribute, text);
    }
  }
  return text;
}

/// Takes bytes from the front.
void take(void* to, std::size_t size, std::string_view& bytes) {
  if (size > bytes.size()) throw InternalError("the bytes of a Draco mesh are cut off");
  if (size > 0) std::memcpy(to, bytes.data(), size);
  bytes.remove_prefix(size);
}

}  // namespace

DracoMesh decode_draco(const std::filesystem::path& file, std::span<const std::byte> bytes,
                       const std::vector<DracoAttribute>& attributes, std::size_t max_bytes) {
  constexpr std::size_t kMemoryBytes = std::size_t{1} << 29, kMemoryPerByte = 400;
  constexpr unsigned kProcessor_s = 20;
  const IsolatedResult result =
      run_isolated([&] { return decoded(bytes, attributes, max_bytes); }, kMemoryBytes + kMemoryPerByte * bytes.size(),
                   kProcessor_s + static_cast<unsigned>(bytes.size() >> 20));
  if (result.end == IsolatedResult::End::refused)
    fail_scene(file, fmt::format("is damaged: a mesh compressed by Draco {}", result.bytes));
  if (result.end == IsolatedResult::End::crashed)
    fail_scene(file, "is damaged: Draco failed, or needed too much memory; export the scene without compression");
  std::string_view rest = result.bytes;
  DracoMesh mesh;
  std::size_t triangles = 0;
  take(&mesh.vertices, sizeof mesh.vertices, rest), take(&triangles, sizeof triangles, rest);
  mesh.indices.resize(3 * triangles);
  take(mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t), rest);
  for (const DracoAttribute& attribute : attributes) {
    std::vector<std::byte>& values = mesh.attributes.emplace_back(mesh.vertices * attribute.components * sizeof(float));
    take(values.data(), values.size(), rest);
  }
  return mesh;
}

}  // namespace esim::inline scene
