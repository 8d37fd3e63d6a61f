#include "esim/studio/scene_view/page_shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "esim/core/parallel.h"
#include "esim/studio/scene_view/glb.h"
#include "esim/studio/server/json.h"

namespace esim::studio {
namespace {

using Eigen::Vector3f;

/// A square whose corners rise one after the other, and whose normals turn.
class Waving : public Deformation {
 public:
  TimeSpan span() const override { return {0, 2'000'000'000}; }

  void evaluate(TimeNs t, DeformedVertices& vertices) const override {
    const auto s = static_cast<float>(to_seconds(std::clamp(t, span().start, span().end)));
    vertices.positions.clear(), vertices.normals.clear();
    for (int i = 0; i < 4; ++i) {
      const auto phase = static_cast<float>(i) + 3 * s;
      vertices.positions.emplace_back(static_cast<float>(i % 2) - 7, static_cast<float>(i) / 2, std::sin(phase));
      vertices.normals.push_back(Vector3f(std::cos(phase), 0.3F, std::sin(phase)).normalized());
    }
    vertices.velocities.assign(4, Vector3f::Zero());
  }
};

template <typename T>
T read(const std::string& bytes, std::size_t at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

/// The inverse of octahedral(), for coordinates in steps.
Vector3f direction_of(std::int8_t u, std::int8_t v) {
  const Eigen::Vector2f at = Eigen::Vector2f(u, v) / 127;
  Vector3f n(at.x(), at.y(), 1 - std::abs(at.x()) - std::abs(at.y()));
  if (n.z() < 0)
    n.head<2>() =
        Eigen::Vector2f(std::copysign(1 - std::abs(at.y()), at.x()), std::copysign(1 - std::abs(at.x()), at.y()));
  return n.normalized();
}

TEST(PageShapes, AreTheVerticesAtTheirTimes) {
  const Waving waving;
  constexpr std::size_t kShape = 24 + 4 * kShapeVertexBytes;
  const std::string bytes = page_shapes(waving, 5, 3);
  ASSERT_EQ(bytes.size(), 3 * kShape);
  for (std::size_t k = 0; k < 3; ++k) {
    DeformedVertices expected;
    const TimeNs t = time_of_shape(5 + static_cast<std::int64_t>(k));
    EXPECT_EQ(t, (5 + static_cast<TimeNs>(k)) * 1'000'000'000 / 30);
    waving.evaluate(t, expected);
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t vertex = k * kShape + 24 + i * kShapeVertexBytes;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto low = read<float>(bytes, k * kShape + 4 * axis),
                   step = read<float>(bytes, k * kShape + 12 + 4 * axis);
        const float at = low + step * read<std::uint16_t>(bytes, vertex + 2 * axis);
        EXPECT_NEAR(at, expected.positions[i][static_cast<int>(axis)], 0.51F * step + 1e-6F);
      }
      const Vector3f normal = direction_of(read<std::int8_t>(bytes, vertex + 6), read<std::int8_t>(bytes, vertex + 7));
      EXPECT_GT(normal.dot(expected.normals[i]), std::cos(0.02F));
    }
  }
}

TEST(PageShapes, AreTheSameInAnyAnswer) {
  const Waving waving;
  EXPECT_EQ(page_shapes(waving, 0, 4), page_shapes(waving, 0, 2) + page_shapes(waving, 2, 2));
  EXPECT_EQ(page_shapes(waving, 60, 1), page_shapes(waving, 900'000'000, 1));  // it rests after its end
}

TEST(PageShapes, OctahedralCoordinatesKeepDirections) {
  EXPECT_EQ(octahedral(Vector3f::Zero()), Eigen::Vector2f(0, 0));
  EXPECT_EQ(octahedral({0, 0, -2}).cwiseAbs(), Eigen::Vector2f(1, 1));
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 1000; ++i) {
    const Vector3f n = Vector3f(normal(random), normal(random), normal(random)).normalized();
    const Eigen::Vector2f at = octahedral(5 * n);
    EXPECT_LE(at.cwiseAbs().maxCoeff(), 1.000001F);
    const Vector3f back = direction_of(static_cast<std::int8_t>(std::lround(127 * at.x())),
                                       static_cast<std::int8_t>(std::lround(127 * at.y())));
    EXPECT_GT(back.dot(n), std::cos(0.02F));
  }
}

/// Vertices of the page are split where texture coordinates differ; each says to which vertex of the mesh it belongs.
TEST(PageShapes, GlbNamesTheVerticesOfDeformingObjects) {
  Mesh mesh;
  mesh.vertices = {{-7, 0, 0}, {-6, 0.5F, 0}, {-7, 1, 0}, {-6, 1.5F, 0}};
  mesh.triangles = {{2, 1, 0}, {1, 2, 3}};
  mesh.texture_uv = {{Eigen::Vector2f(0, 0), {1, 0}, {0, 1}}, {Eigen::Vector2f(0.5F, 0), {0, 0}, {1, 1}}};
  mesh.material = {0, 0};
  mesh.materials = {{"grey", nullptr}};
  mesh.coloured = {mesh.materials, mesh.materials, mesh.materials};
  Scene scene;
  scene.objects.push_back({"rigid", mesh, true});
  scene.objects.push_back({"waving", mesh, true, nullptr, std::make_shared<const Waving>()});
  const std::string glb = make_glb(scene, Workers(1)).bytes;
  const auto length = read<std::uint32_t>(glb, 12);
  const Json json = Json::parse(glb.substr(20, length));
  EXPECT_FALSE(json["meshes"][0]["primitives"][0].contains("extras"));
  const Json& primitive = json["meshes"][1]["primitives"][0];
  const Json& accessor = json["accessors"][primitive["extras"]["vertices"].get<std::size_t>()];
  const Json& positions = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
  EXPECT_EQ(accessor["count"], positions["count"]);
  const auto start = [&](const Json& of) {
    return 20 + length + 8 + json["bufferViews"][of["bufferView"].get<std::size_t>()]["byteOffset"].get<std::size_t>();
  };
  for (std::size_t i = 0; i < accessor["count"].get<std::size_t>(); ++i) {
    const auto vertex = read<std::uint32_t>(glb, start(accessor) + 4 * i);
    ASSERT_LT(vertex, 4U);
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_EQ(read<float>(glb, start(positions) + 12 * i + 4 * axis), mesh.vertices[vertex][static_cast<int>(axis)]);
  }
  EXPECT_EQ(accessor["count"], 5);  // one corner has other coordinates
}

}  // namespace
}  // namespace esim::studio
