// glTF files whose meshes are compressed: they equal the files before compression.
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "esim/core/error.h"
#include "esim/scene/scene_file.h"
#include "loaded_glb.h"
#include "skinned_glb.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Json = nlohmann::json;
using test::GlbWriter;
using test::load;
using test::Loaded;
using test::refusal;
using test::SkinnedFigure;

/// The file is read or refused.
bool survives(const std::string& bytes) {
  try {
    load(bytes);
  } catch (const UserError&) {
  }
  return true;
}

double largest_difference(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, double{test::largest_difference(a[i], b[i])});
  return largest;
}

/// A curved sheet of n x n vertices.
struct Sheet {
  std::vector<float> positions, normals, uv;
  std::vector<std::uint32_t> indices;

  explicit Sheet(std::uint32_t n) {
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const float u = static_cast<float>(x) / static_cast<float>(n - 1),
                    v = static_cast<float>(y) / static_cast<float>(n - 1);
        positions.insert(positions.end(), {u, v, 0.2F * std::sin(5 * u) * v});
        const Eigen::Vector3f normal = Eigen::Vector3f(-std::cos(5 * u) * v, -0.2F * std::sin(5 * u), 1).normalized();
        normals.insert(normals.end(), normal.begin(), normal.end());
        uv.insert(uv.end(), {u, v});
        if (x + 1 == n || y + 1 == n) continue;
        const std::uint32_t i = y * n + x;
        indices.insert(indices.end(), {i, i + 1, i + n, i + n, i + 1, i + n + 1});
      }
    }
  }
  std::size_t vertices() const { return positions.size() / 3; }
};

std::size_t add_accessor(GlbWriter& glb, std::size_t view, int component, std::size_t count, const char* type,
                         bool normalised = false) {
  return glb.add("accessors", {{"bufferView", view},
                               {"componentType", component},
                               {"count", count},
                               {"type", type},
                               {"normalized", normalised}});
}

void add_mesh(GlbWriter& glb, const Json& attributes, std::size_t indices) {
  glb.add("meshes", {{"name", "sheet"}, {"primitives", {{{"attributes", attributes}, {"indices", indices}}}}});
  glb.add_node({{"mesh", glb.json["meshes"].size() - 1}});
}

std::size_t add_indices(GlbWriter& glb, const std::vector<std::uint32_t>& indices) {
  return add_accessor(glb, glb.add_view(indices.data(), 4 * indices.size()), 5125, indices.size(), "SCALAR");
}

GlbWriter plain(const Sheet& sheet) {
  GlbWriter glb;
  add_mesh(glb,
           {{"POSITION", glb.floats(sheet.positions, "VEC3")},
            {"NORMAL", glb.floats(sheet.normals, "VEC3")},
            {"TEXCOORD_0", glb.floats(sheet.uv, "VEC2")}},
           add_indices(glb, sheet.indices));
  return glb;
}

// --- meshoptimizer ---------------------------------------------------------------------------------------------------

/// A view of attributes that are compressed. Its own buffer is a placeholder without data.
std::size_t compressed_view(GlbWriter& glb, const void* data, std::size_t count, std::size_t stride,
                            const char* filter = "NONE") {
  std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(count, stride));
  bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), data, count, stride));
  const std::size_t view = glb.add_view(bytes.data(), bytes.size());
  Json& json = glb.json["bufferViews"][view];
  Json compression = json;
  compression.update({{"byteStride", stride}, {"count", count}, {"mode", "ATTRIBUTES"}, {"filter", filter}});
  json = {{"buffer", 1},
          {"byteOffset", 0},
          {"byteLength", count * stride},
          {"byteStride", stride},
          {"extensions", {{"EXT_meshopt_compression", compression}}}};
  return view;
}

std::size_t compressed_triangles(GlbWriter& glb, const std::vector<std::uint32_t>& indices, std::size_t vertices,
                                 bool as_sequence) {
  std::vector<unsigned char> bytes(std::max(meshopt_encodeIndexBufferBound(indices.size(), vertices),
                                            meshopt_encodeIndexSequenceBound(indices.size(), vertices)));
  bytes.resize(as_sequence ? meshopt_encodeIndexSequence(bytes.data(), bytes.size(), indices.data(), indices.size())
                           : meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), indices.data(), indices.size()));
  const std::size_t view = glb.add_view(bytes.data(), bytes.size());
  Json& json = glb.json["bufferViews"][view];
  Json compression = json;
  compression.update({{"byteStride", 4}, {"count", indices.size()}, {"mode", as_sequence ? "INDICES" : "TRIANGLES"}});
  json = {
      {"buffer", 1}, {"byteLength", 4 * indices.size()}, {"extensions", {{"EXT_meshopt_compression", compression}}}};
  return add_accessor(glb, view, 5125, indices.size(), "SCALAR");
}

/// The writer's file with a second buffer, for views that are compressed.
std::string with_placeholder(const GlbWriter& glb) {
  GlbWriter whole = glb;
  whole.json["extensionsRequired"] = {"EXT_meshopt_compression", "KHR_mesh_quantization"};
  return whole.bytes({{{"byteLength", 1 << 20}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}});
}

GlbWriter compressed(const Sheet& sheet, bool as_sequence) {
  GlbWriter glb;
  const std::size_t n = sheet.vertices();
  std::vector<std::int8_t> coded(4 * n);
  std::vector<float> padded;
  for (std::size_t i = 0; i < n; ++i)
    padded.insert(padded.end(), {sheet.normals[3 * i], sheet.normals[3 * i + 1], sheet.normals[3 * i + 2], 0});
  meshopt_encodeFilterOct(coded.data(), n, 4, 8, padded.data());
  const std::size_t positions = add_accessor(glb, compressed_view(glb, sheet.positions.data(), n, 12), 5126, n, "VEC3");
  const std::size_t normals =
      add_accessor(glb, compressed_view(glb, coded.data(), n, 4, "OCTAHEDRAL"), 5120, n, "VEC3", true);
  const std::size_t uv = add_accessor(glb, compressed_view(glb, sheet.uv.data(), n, 8), 5126, n, "VEC2");
  add_mesh(glb, {{"POSITION", positions}, {"NORMAL", normals}, {"TEXCOORD_0", uv}},
           compressed_triangles(glb, sheet.indices, n, as_sequence));
  return glb;
}

/// Triangles whose corners may be rotated: with the smallest index first.
std::vector<std::array<std::uint32_t, 3>> canonical(std::vector<std::array<std::uint32_t, 3>> triangles) {
  for (auto& triangle : triangles)
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  return triangles;
}

TEST(CompressedGltf, MeshoptEqualsTheOriginal) {
  const Sheet sheet(30);
  const Loaded expected = load(plain(sheet));
  for (const bool as_sequence : {false, true}) {
    const Loaded read = load(with_placeholder(compressed(sheet, as_sequence)));
    EXPECT_EQ(read.warnings, std::vector<std::string>());
    EXPECT_EQ(read.mesh().vertices, expected.mesh().vertices);
    EXPECT_EQ(canonical(read.mesh().triangles), canonical(expected.mesh().triangles));
    EXPECT_LT(largest_difference(read.mesh().normals, expected.mesh().normals), 0.02);  // 8 bits
  }
}

TEST(CompressedGltf, DamagedMeshoptIsReadOrRefused) {
  const GlbWriter whole = compressed(Sheet(12), false);
  const auto with = [&](const char* key, const Json& value) {
    GlbWriter changed = whole;
    for (Json& view : changed.json["bufferViews"]) view["extensions"]["EXT_meshopt_compression"][key] = value;
    return test::message_of<UserError>([&] { load(with_placeholder(changed)); });
  };
  EXPECT_TRUE(test::contains(with("count", 4'000'000'000U), "is cut off"));
  EXPECT_TRUE(test::contains(with("byteStride", 7), "invalid byteStride"));
  EXPECT_TRUE(test::contains(with("byteStride", 0), "invalid byteStride"));
  EXPECT_TRUE(test::contains(with("mode", "LZ4"), "unknown mode"));
  EXPECT_TRUE(test::contains(with("filter", "BLUR"), "filter"));
  EXPECT_TRUE(test::contains(with("buffer", 9), "buffer is not one of the 2 buffers"));
  const std::string bytes = with_placeholder(whole);
  std::mt19937 random(1);
  const std::size_t binary = bytes.find("BIN");
  for (int i = 0; i < 500; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 4; ++k)
      damaged[binary + 8 + random() % (bytes.size() - binary - 8)] = static_cast<char>(random());
    EXPECT_TRUE(survives(damaged));
  }
}

TEST(CompressedGltf, QuantisedMeshesAreScaledByTheirNode) {
  GlbWriter glb;
  const std::vector<std::int16_t> positions = {0, 0, 0, 0, 1000, 0, 0, 0, 0, -2000, 0, 0};  // padded to 8 bytes
  const std::vector<std::uint16_t> uv = {0, 0, 65535, 0, 0, 65535};
  const std::size_t view = glb.add_view(positions.data(), 24);
  glb.json["bufferViews"][view]["byteStride"] = 8;
  const std::size_t position = add_accessor(glb, view, 5122, 3, "VEC3");
  const std::size_t coordinate = add_accessor(glb, glb.add_view(uv.data(), 12), 5123, 3, "VEC2", true);
  glb.add("meshes", {{"primitives",
                      {{{"attributes", {{"POSITION", position}, {"TEXCOORD_0", coordinate}}},
                        {"indices", glb.indices({0, 1, 2})}}}}});
  glb.add_node({{"mesh", 0}, {"scale", {0.001, 0.001, 0.001}}});
  glb.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const Loaded read = load(glb);
  EXPECT_LT(test::largest_difference(read.mesh().vertices[1], Eigen::Vector3f(1, 0, 0)), 1e-6);
  EXPECT_LT(test::largest_difference(read.mesh().vertices[2], Eigen::Vector3f(0, 0, -2)), 1e-6);
  EXPECT_EQ(read.mesh().texture_uv[0][1], Eigen::Vector2f(1, 0));
}

// --- Draco -----------------------------------------------------------------------------------------------------------

template <typename T>
int add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, draco::DataType data,
                  const std::vector<T>& values, std::size_t components) {
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, static_cast<std::int8_t>(components), data, false,
                 static_cast<std::int64_t>(components * sizeof(T)), 0);
  const auto count = static_cast<std::uint32_t>(values.size() / components);
  mesh.set_num_points(count);
  const int id = mesh.AddAttribute(attribute, true, count);
  for (std::uint32_t i = 0; i < count; ++i)
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i * components]);
  return id;
}

/// A figure whose mesh is compressed without loss of precision.
GlbWriter draco_figure(const SkinnedFigure& figure, bool reorders) {
  GlbWriter glb = figure.glb();
  std::vector<float> positions, normals, weights;
  std::vector<std::uint8_t> joints;
  draco::Mesh mesh;
  for (const auto& vertex : figure.vertices) {
    for (const double x : vertex.position) positions.push_back(static_cast<float>(x));
    for (const double x : vertex.normal) normals.push_back(static_cast<float>(x));
    for (const auto& [joint, weight] : vertex.influences)
      joints.push_back(static_cast<std::uint8_t>(joint)), weights.push_back(static_cast<float>(weight));
  }
  using Attribute = draco::GeometryAttribute;
  add_attribute(mesh, Attribute::POSITION, draco::DT_FLOAT32, positions, 3);
  add_attribute(mesh, Attribute::NORMAL, draco::DT_FLOAT32, normals, 3);
  add_attribute(mesh, Attribute::GENERIC, draco::DT_UINT8, joints, 4);
  add_attribute(mesh, Attribute::GENERIC, draco::DT_FLOAT32, weights, 4);
  for (std::uint32_t i = 0; i + 2 < figure.vertices.size(); i += 3)
    mesh.AddFace({draco::PointIndex(i), draco::PointIndex(i + 1), draco::PointIndex(i + 2)});
  draco::ExpertEncoder encoder(mesh);
  encoder.SetEncodingMethod(reorders ? draco::MESH_EDGEBREAKER_ENCODING : draco::MESH_SEQUENTIAL_ENCODING);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeToBuffer(&buffer).ok());

  Json& primitive = glb.json["meshes"][0]["primitives"][0];
  const std::size_t view = glb.add_view(buffer.data(), buffer.size());
  primitive["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", view}, {"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"JOINTS_0", 2}, {"WEIGHTS_0", 3}}}};
  for (const auto& [name, accessor] : primitive["attributes"].items())
    glb.json["accessors"][accessor.get<std::size_t>()].erase("bufferView");
  glb.json["accessors"][primitive["indices"].get<std::size_t>()].erase("bufferView");
  glb.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return glb;
}

/// The corners of all triangles at a time, sorted.
std::vector<std::array<float, 3>> corners_at(const SceneObject& object, TimeNs t) {
  DeformedVertices vertices;
  object.deformation->evaluate(t, vertices);
  std::vector<std::array<float, 3>> corners;
  for (const auto& triangle : object.mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3f& p = vertices.positions[corner];
      corners.push_back({p.x(), p.y(), p.z()});
    }
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

TEST(CompressedGltf, DracoEqualsTheOriginal) {
  const SkinnedFigure figure(11, 5, 60, 0, 4);
  const Loaded expected = load(figure.glb());
  for (const bool reorders : {false, true}) {
    const Loaded read = load(draco_figure(figure, reorders));
    EXPECT_EQ(read.warnings, std::vector<std::string>());
    for (const double t_s : {0.0, 0.4, 1.0}) {
      const auto theirs = corners_at(expected.file.scene.objects.at(0), to_ns(t_s));
      EXPECT_EQ(corners_at(read.file.scene.objects.at(0), to_ns(t_s)), theirs) << reorders << t_s;
    }
  }
}

TEST(CompressedGltf, DamagedDracoIsReadOrRefused) {
  const GlbWriter glb = draco_figure(SkinnedFigure(12, 3, 30, 0, 4), true);
  GlbWriter missing = glb;
  missing.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["NORMAL"] = 17;
  EXPECT_TRUE(test::contains(refusal(missing), "no attribute 17 of 3 components"));
  GlbWriter cut = glb;
  cut.json["bufferViews"].back()["byteLength"] = 40;
  EXPECT_TRUE(test::contains(refusal(cut), "Draco"));
  const std::string bytes = glb.bytes();
  const std::size_t begin = bytes.rfind("DRACO");
  ASSERT_NE(begin, std::string::npos);
  std::mt19937 random(1);
  for (int i = 0; i < 150; ++i) {
    std::string damaged = bytes;
    for (int k = 0; k < 3; ++k)
      damaged[begin + 5 + random() % (bytes.size() - begin - 5)] = static_cast<char>(random());
    EXPECT_TRUE(survives(damaged));
  }
}

// --- textures --------------------------------------------------------------------------------------------------------

GlbWriter textured(const char* extension, const std::string& image) {
  GlbWriter glb;
  glb.add("images", {{"bufferView", glb.add_view(image.data(), image.size())}});
  glb.add("textures", {{"extensions", {{extension, {{"source", 0}}}}}});
  glb.add("materials", {{"name", "paint"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  glb.add_node({{"mesh", glb.add_triangle(0)}});
  glb.json["extensionsRequired"] = {extension};
  return glb;
}

TEST(CompressedGltf, WebpTexturesAreRead) {
  std::vector<unsigned char> bytes;
  cv::imencode(".webp", cv::Mat(4, 4, CV_8UC3, cv::Scalar(255, 255, 255)), bytes);
  const Loaded read = load(textured("EXT_texture_webp", {bytes.begin(), bytes.end()}));
  EXPECT_EQ(read.warnings, std::vector<std::string>());
  EXPECT_NE(read.mesh().materials.at(0).texture, nullptr);
}

TEST(CompressedGltf, BasisTexturesAreGreyWithAWarning) {
  const Loaded read = load(textured("KHR_texture_basisu", std::string("\xABKTX 20\xBB\r\n\x1A\n", 12)));
  ASSERT_FALSE(read.warnings.empty());
  EXPECT_TRUE(test::contains(read.warnings[0], "material paint: its texture is in Basis Universal"));
  EXPECT_EQ(read.mesh().materials.at(0).texture, nullptr);
  EXPECT_FLOAT_EQ(read.mesh().materials.at(0).base, 0.2F);
}

}  // namespace
}  // namespace esim
