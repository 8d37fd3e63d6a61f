// Testing rays against the few triangles that a cell of the image may see: the same hits as by Embree, and no holes.
#include "esim/backends/raycast/triangles/triangle_tree.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>
#include <tuple>

#include "render/scenes.h"

namespace esim {
namespace {

// With more triangles than this, Embree is used.
constexpr std::size_t kMaxInTree = 20'000;

/// A box with objects in it, in view of the moving camera.
Mesh furnished_box() {
  Mesh mesh = test::box_mesh();
  for (const auto& [scale, x, y] : {std::tuple{0.15F, 1.9F, 0.3F}, {0.1F, 1.5F, -0.5F}, {0.2F, 3.0F, -1.0F}}) {
    Mesh thing = test::box_mesh();
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto R = so3_exp(Eigen::Vector3d(x, y, 1)).toRotationMatrix().cast<float>().eval();
    for (const Eigen::Vector3f& vertex : thing.vertices)
      mesh.vertices.emplace_back(R * vertex * scale + Eigen::Vector3f(x, y, 0.1F));
    for (const auto& [a, b, c] : thing.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.texture_uv.insert(mesh.texture_uv.end(), thing.texture_uv.begin(), thing.texture_uv.end());
    mesh.material.resize(mesh.triangles.size(), 0);
  }
  return mesh;
}

/// The same with so many triangles outside the box that no tree is built.
Mesh with_crowd_outside(Mesh mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const float x : {20.0F, 20.1F, 20.2F}) mesh.vertices.emplace_back(x, x * x / 20, 1);
  mesh.triangles.resize(mesh.triangles.size() + kMaxInTree, {first, first + 1, first + 2});
  mesh.texture_uv.resize(mesh.triangles.size());
  mesh.material.resize(mesh.triangles.size(), 0);
  return mesh;
}

TEST(TriangleTree, FindsWhatEmbreeFinds) {
  const auto alone = build_raycast_scene(still_scene(furnished_box()));
  const auto crowded = build_raycast_scene(still_scene(with_crowd_outside(furnished_box())));
  for (const int rays : {1, 16}) {
    for (const int kind : {0, 2}) {
      const Camera model = test::distorted_camera(kind);
      const auto a = make_raycast_renderer(alone, {1, rays}, model, test::two_threads());
      const auto b = make_raycast_renderer(crowded, {1, rays}, model, test::two_threads());
      int differ = 0;
      for (const double t : {0.0, 0.1, 0.2, 0.3}) {
        const Kinematics camera = test::moving_camera(t);
        const Sample found = test::render(*a, model, camera), expected = test::render(*b, model, camera);
        for (std::size_t i = 0; i < expected.depth.size(); ++i) {
          const float z = expected.depth.data()[i], e = expected.irradiance.data()[i];
          ASSERT_TRUE(std::isfinite(found.depth.data()[i])) << i;
          const bool same =
              std::fabs(found.depth.data()[i] - z) < 1e-5F * z && std::fabs(found.irradiance.data()[i] - e) < 1e-4F;
          differ += same ? 0 : 1;
        }
      }
      EXPECT_LT(differ, 10) << rays << " rays, lens " << kind;  // of 43,200: rays that graze an edge
    }
  }
}

TEST(TriangleTree, HasNoHolesBetweenTriangles) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  for (const int n : {3, 10, 60}) {
    Mesh ball = test::ball_mesh(1, n);
    ASSERT_LE(ball.triangles.size(), kMaxInTree);
    for (Eigen::Vector3f& vertex : ball.vertices) vertex = 5 * vertex + Eigen::Vector3f(100, -20, 7);
    const Camera model = test::distorted_camera(0);
    const auto renderer = make_raycast_renderer(build_raycast_scene(still_scene(ball)), {}, model, test::two_threads());
    for (int pose = 0; pose < 40; ++pose) {
      Kinematics camera;
      camera.T_world_body = {so3_exp(3 * vector()), 0.9 * vector() + Eigen::Vector3d(100, -20, 7)};
      const Sample sample = test::render(*renderer, model, camera);
      for (int y = 0; y < model.height; ++y) {
        for (int x = 0; x < model.width; ++x)
          ASSERT_TRUE(std::isfinite(sample.depth(x, y))) << x << ", " << y << " in pose " << pose;
      }
    }
  }
}

TEST(TriangleTree, FindsEveryTriangleThatIsSeenOrSaysThatTheyAreTooMany) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto vector = [&] { return Eigen::Vector3f(uniform(random), uniform(random), uniform(random)); };
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i < 3 * 500; i += 3) {
    const Eigen::Vector3f middle = 4 * vector();
    for (int corner = 0; corner < 3; ++corner) vertices.emplace_back(middle + 0.3F * vector());
    triangles.push_back({i, i + 1, i + 2});
  }
  const TriangleTree tree(vertices, triangles);
  const Eigen::Matrix3f R = so3_exp(Eigen::Vector3d(0.3, -0.8, 1.1)).toRotationMatrix().cast<float>();
  int complete = 0, overfull = 0;
  for (int cell = 0; cell < 200; ++cell) {
    const float x = uniform(random), y = uniform(random), size = cell % 2 == 0 ? 0.05F : 3.0F;
    const BearingBounds bounds{x, x + size, y, y + size};
    const Eigen::Vector3f camera = vector();
    SeenTriangles found;
    if (!tree.find(bounds, R, camera, found)) {
      EXPECT_TRUE(found.full());
      ++overfull;
      continue;
    }
    ++complete;
    std::set<std::uint32_t> indices;
    for (const SeenTriangle& triangle : found.from(0)) EXPECT_TRUE(indices.insert(triangle.index).second);
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      // A triangle whose centre is within the bounds must be found.
      Eigen::Vector3f p = Eigen::Vector3f::Zero();
      for (const std::uint32_t corner : triangles[i]) p += R.transpose() * (vertices[corner] - camera) / 3;
      const float u = p.x() / p.z(), v = p.y() / p.z();
      const bool seen = p.z() > 0 && u > x && u < x + size && v > y && v < y + size;
      EXPECT_TRUE(!seen || indices.contains(i)) << cell << ", " << i;
    }
  }
  EXPECT_GT(complete, 50);
  EXPECT_GT(overfull, 20);
}

TEST(TriangleTree, IsMadeOfAnything) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector3f> vertices = {{0, 0, 1}, {nan, 0, 1}, {inf, 1, -inf}, {1e38F, -1e38F, 1e38F}};
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i < 200; ++i) triangles.push_back({i % 4, i / 4 % 4, i / 16 % 4});
  SeenTriangles found;
  TriangleTree(vertices, triangles).find({-1, 1, -1, 1}, Eigen::Matrix3f::Identity(), {0, 0, 0}, found);
  EXPECT_FALSE(TriangleTree().find({-1, 1, -1, 1}, Eigen::Matrix3f::Identity(), {0, 0, 0}, found));
}

}  // namespace
}  // namespace esim
