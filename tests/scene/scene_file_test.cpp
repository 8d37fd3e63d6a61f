#include "esim/scene/scene_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "esim/scene/planes.h"
#include "glb_writer.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"
#include "support/test_data.h"

namespace esim {
namespace {

using Json = nlohmann::json;
using test::GlbWriter;

/// Collects warnings.
struct Warnings {
  std::vector<std::string> texts;
  WarningHandler handler() {
    return [this](const std::string& text) { texts.push_back(text); };
  }
};

SceneFile load(const std::filesystem::path& path) {
  Warnings warnings;
  SceneFile file = load_scene_file(path, warnings.handler());
  EXPECT_EQ(warnings.texts, std::vector<std::string>());
  return file;
}

SceneFile load(const GlbWriter& glb) {
  const test::TemporaryDirectory folder;
  return load(folder.write("scene.glb", glb.bytes()));
}

/// In glTF y points up, in esim z.
Eigen::Vector3d from_gltf(double x, double y, double z) { return {x, -z, y}; }

/// The image as PNG or the like, from the top left, blue first.
std::string encoded(const cv::Mat& image, const char* extension) {
  std::vector<unsigned char> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

/// A scene of one triangle whose material has `pbr`, with an embedded image of one colour.
GlbWriter textured(Json pbr, const cv::Vec4b& blue_green_red_alpha) {
  GlbWriter glb;
  const std::string png = encoded(cv::Mat(2, 2, CV_8UC4, blue_green_red_alpha), ".png");
  const std::size_t view = glb.add_view(png.data(), png.size());
  glb.add("images", {{"bufferView", view}, {"mimeType", "image/png"}});
  glb.add("textures", {{"source", 0}});
  pbr["baseColorTexture"] = {{"index", 0}};
  glb.add("materials", {{"name", "paint"}, {"pbrMetallicRoughness", pbr}});
  glb.add_node({{"mesh", glb.add_triangle(0)}});
  return glb;
}

TEST(SceneFile, NodesPutMeshesIntoTheWorld) {
  GlbWriter glb;
  const std::size_t mesh = glb.add_triangle();
  const double half = std::sqrt(0.5);
  const std::size_t child = glb.add("nodes", {{"mesh", mesh}, {"translation", {0, 0, 3}}});
  // A quarter turn about y maps x to -z and z to x, after a scale of 2 along x and before a translation by (1, 2, 0).
  glb.add_node(
      {{"children", {child}}, {"rotation", {0, half, 0, half}}, {"scale", {2, 1, 1}}, {"translation", {1, 2, 0}}});
  const Mesh mesh_read = load(glb).scene.objects.at(0).mesh;
  // Vertex (1, 0, 0): (1, 0, 3) in the parent, (2, 0, 3) scaled, (3, 0, -2) rotated, (4, 2, -2) translated.
  ASSERT_EQ(mesh_read.vertices.size(), 3U);
  EXPECT_LT(test::largest_difference(mesh_read.vertices[0], from_gltf(4, 2, 0).cast<float>()), 1e-6);
  EXPECT_LT(test::largest_difference(mesh_read.vertices[1], from_gltf(4, 2, -2).cast<float>()), 1e-6);
  EXPECT_LT(test::largest_difference(mesh_read.vertices[2], from_gltf(4, 3, 0).cast<float>()), 1e-6);
}

TEST(SceneFile, AnAnimatedSubtreeIsAMovingObjectAndTheRestStands) {
  GlbWriter glb;
  const std::size_t mesh = glb.add_triangle();
  glb.add_node({{"name", "floor"}, {"mesh", mesh}});
  const std::size_t child = glb.add("nodes", {{"mesh", mesh}, {"translation", {0, 0, 1}}});
  const std::size_t mover =
      glb.add_node({{"name", "mover"}, {"mesh", mesh}, {"children", {child}}, {"scale", {2, 2, 2}}});
  glb.animate(mover, "translation", {0, 1}, {0, 0, 0, 4, 0, 0});
  const SceneFile file = load(glb);

  ASSERT_EQ(file.scene.objects.size(), 2U);
  EXPECT_FALSE(file.scene.objects[0].moves);
  EXPECT_TRUE(file.scene.objects[1].moves);
  EXPECT_EQ(file.scene.objects[1].name, "mover");
  EXPECT_EQ(file.scene.objects[1].mesh.triangles.size(), 2U);
  ASSERT_EQ(file.motions.size(), 1U);

  // At every time the vertices follow the node: scaled by 2, translated by 4 t along x.
  for (const ScenePose& pose : file.motions[0]) {
    const double t = to_seconds(pose.t);
    const Eigen::Vector3d vertex = pose.T_world_object * file.scene.objects[1].mesh.vertices[1].cast<double>();
    EXPECT_LT(test::largest_difference(vertex, from_gltf(4 * t + 2, 0, 0)), 1e-6) << t;
  }
  EXPECT_EQ(file.animation.start, 0);
  EXPECT_EQ(file.animation.end, kNsPerSecond);
}

/// The position at t = 0.25 s of a node that these keys animate.
Eigen::Vector3d place_at_a_quarter(const std::vector<float>& values, const char* interpolation) {
  GlbWriter glb;
  const std::size_t mover = glb.add_node({{"mesh", glb.add_triangle()}});
  glb.animate(mover, "translation", {0, 1}, values, interpolation);
  const SceneFile file = load(glb);
  for (const ScenePose& pose : file.motions.at(0)) {
    if (pose.t == kNsPerSecond / 4) return pose.T_world_object.translation;
  }
  ADD_FAILURE() << "not sampled at 0.25 s";
  return Eigen::Vector3d::Zero();
}

TEST(SceneFile, AnimationsInterpolateAsTheFileSays) {
  const std::vector<float> from_0_to_1 = {0, 0, 0, 1, 0, 0};
  EXPECT_NEAR(place_at_a_quarter(from_0_to_1, "LINEAR").x(), 0.25, 1e-6);
  EXPECT_NEAR(place_at_a_quarter(from_0_to_1, "STEP").x(), 0, 1e-6);
  // Slope 2 at the beginning, 0 at the end: 2 (s³ - 2s² + s) + 3s² - 2s³ = 2s - s² for s on [0, 1].
  const std::vector<float> cubic = {9, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 1, 0, 0, 9, 0, 0};
  EXPECT_NEAR(place_at_a_quarter(cubic, "CUBICSPLINE").x(), 0.5 - 0.0625, 1e-6);
}

TEST(SceneFile, RotationsTurnTheShorterWayAtAConstantRate) {
  GlbWriter glb;
  const std::size_t mover = glb.add_node({{"mesh", glb.add_triangle()}});
  const auto s = static_cast<float>(std::sin(0.5)), c = static_cast<float>(std::cos(0.5));
  glb.animate(mover, "rotation", {0, 1}, {0, 0, 0, 1, 0, -s, 0, -c});  // 1 rad about y, which is up
  const SceneMotion motion = load(glb).motions.at(0);
  const Eigen::Vector3d x = motion.front().T_world_object.rotation.conjugate() * Eigen::Vector3d::UnitX();
  for (const ScenePose& pose : motion) {
    const Eigen::Vector3d turned = pose.T_world_object.rotation * x;
    EXPECT_NEAR(std::atan2(turned.y(), turned.x()), to_seconds(pose.t), 1e-5);
  }
}

TEST(SceneFile, KeysThatAreCloseTogetherAreTakenAsTheyAre) {
  GlbWriter glb;
  const std::size_t mover = glb.add_node({{"mesh", glb.add_triangle()}});
  std::vector<float> times, values;
  for (int i = 0; i <= 24; ++i) {
    times.push_back(static_cast<float>(i) / 24);
    values.insert(values.end(), {std::sin(times.back()), 0, 0});
  }
  glb.animate(mover, "translation", times, values);
  EXPECT_EQ(load(glb).motions.at(0).size(), 25U);
}

TEST(SceneFile, CamerasLookAlongTheirZAxisWithYDown) {
  GlbWriter glb;
  glb.add_node({{"mesh", glb.add_triangle()}});
  glb.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"aspectRatio", 2.0}, {"znear", 0.1}}}});
  glb.add_node({{"name", "Eye"}, {"camera", 0}, {"translation", {1, 2, 3}}});
  const std::size_t moving = glb.add_node({{"name", "Drone"}, {"camera", 0}});
  glb.animate(moving, "translation", {0.5F, 2.5F}, {0, 0, 0, 2, 0, 0});
  const SceneFile file = load(glb);

  ASSERT_EQ(file.cameras.size(), 2U);
  const SceneCamera& eye = file.cameras[0];
  EXPECT_EQ(eye.name, "Eye");
  EXPECT_NEAR(*eye.horizontal_fov_rad, 2 * std::atan(2 * std::tan(0.5)), 1e-9);
  ASSERT_EQ(eye.motion.size(), 1U);
  const SE3& pose = eye.motion[0].T_world_object;
  EXPECT_LT(test::largest_difference(pose.translation, from_gltf(1, 2, 3)), 1e-9);
  EXPECT_LT(test::largest_difference(pose.rotation * Eigen::Vector3d::UnitZ(), from_gltf(0, 0, -1)), 1e-9);
  EXPECT_LT(test::largest_difference(pose.rotation * Eigen::Vector3d::UnitY(), from_gltf(0, -1, 0)), 1e-9);

  const SceneMotion& drone = file.cameras[1].motion;
  EXPECT_EQ(drone.front().t, kNsPerSecond / 2);
  EXPECT_EQ(drone.back().t, 5 * kNsPerSecond / 2);
  EXPECT_NEAR(drone.back().T_world_object.translation.x(), 2, 1e-6);
}

TEST(SceneFile, TexturesAreSrgbAndFactorsLinear) {
  // sRGB codes (red, green, blue) = (188, 0, 255), and alpha, which opaque materials ignore.
  const GlbWriter glb = textured({{"baseColorFactor", {0.5, 1.0, 0.25, 1.0}}}, cv::Vec4b(255, 0, 188, 10));
  const Material material = load(glb).scene.objects.at(0).mesh.materials.at(0);
  ASSERT_NE(material.texture, nullptr);
  const float expected = luminance(0.5F * linear_from_srgb(188.0F / 255), 0, 0.25F);
  EXPECT_NEAR(material.texture->texels()(0, 0), expected, 1e-3 * expected);
  EXPECT_EQ(material.base, 1);
  EXPECT_FALSE(material.unlit);
}

TEST(SceneFile, KeepsColoursWhereTheyAreWanted) {
  GlbWriter glb = textured({{"baseColorFactor", {0.5, 1.0, 0.25, 1.0}}}, cv::Vec4b(255, 128, 188, 10));
  glb.add("materials",
          {{"pbrMetallicRoughness", {{"baseColorFactor", {0.1, 0.2, 0.3, 1.0}}}}, {"emissiveFactor", {0.0, 0.4, 0.8}}});
  const test::TemporaryDirectory folder;
  const auto path = folder.write("scene.glb", glb.bytes());
  const Mesh mesh = load_mesh(path, Warnings().handler(), SceneLook::colour),
             grey = load_mesh(path, Warnings().handler());
  const std::array<double, 3> paint = {0.5 * linear_from_srgb(188.0F / 255), linear_from_srgb(128.0F / 255), 0.25};
  for (std::size_t colour = 0; colour < 3; ++colour) {
    EXPECT_TRUE(grey.coloured[colour].empty());
    ASSERT_EQ(mesh.coloured[colour].size(), 2U);
    const Material &textured = mesh.coloured[colour][0], &plain = mesh.coloured[colour][1];
    ASSERT_NE(textured.texture, nullptr);
    EXPECT_NEAR(textured.base * textured.texture->texels()(1, 1), paint[colour], 1e-3 * paint[colour]);
    EXPECT_FLOAT_EQ(plain.base, 0.1F * static_cast<float>(colour + 1));
    EXPECT_FLOAT_EQ(plain.emission, 0.4F * static_cast<float>(colour));
  }
  // Luminance is the same as without colours.
  EXPECT_EQ(mesh.materials[0].texture->texels()(0, 0), grey.materials[0].texture->texels()(0, 0));
  EXPECT_EQ(mesh.materials[1].base, grey.materials[1].base);
}

TEST(SceneFile, UnlitEmissionAndBakedRadiance) {
  GlbWriter glb;
  glb.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1.0}}}},
                        {"extensions", {{"KHR_materials_unlit", Json::object()}}},
                        {"extras", {{"esim_radiance_scale", 6.0}}}});
  glb.add("materials", {{"emissiveFactor", {1, 1, 1}},
                        {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 4.0}}}}}});
  glb.add_node({{"mesh", glb.add_triangle(0)}});
  const std::vector<Material> materials = load(glb).scene.objects.at(0).mesh.materials;
  EXPECT_TRUE(materials[0].unlit);
  EXPECT_FLOAT_EQ(materials[0].base, 3);
  EXPECT_FALSE(materials[1].unlit);
  EXPECT_FLOAT_EQ(materials[1].base, 1);
  EXPECT_FLOAT_EQ(materials[1].emission, 4);
}

TEST(SceneFile, ObjAndPlyAreTakenAsTheyAre) {
  const test::TemporaryDirectory folder;
  const auto obj = folder.write("a.obj", "v 1 2 3\nv 4 5 6\nv 7 8 10\nf 1 2 3\n");
  const auto ply = folder.write("a.ply",
                                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                                "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                "1 2 3\n4 5 6\n7 8 10\n3 0 1 2\n");
  for (const auto& path : {obj, ply}) {
    const Mesh mesh = load(path).scene.objects.at(0).mesh;
    ASSERT_EQ(mesh.vertices.size(), 3U) << path;
    EXPECT_EQ(mesh.vertices[mesh.triangles[0][2]], Eigen::Vector3f(7, 8, 10)) << path;
  }
}

TEST(SceneFile, ObjMaterialsWithoutIlluminationAreUnlit) {
  const test::TemporaryDirectory folder;
  folder.write("a.mtl", "newmtl baked\nKd 1 1 1\nillum 0\nnewmtl lit\nKd 1 1 1\nillum 1\nnewmtl plain\nKd 1 1 1\n");
  const auto obj = folder.write("a.obj",
                                "mtllib a.mtl\nv 1 2 3\nv 4 5 6\nv 7 8 10\n"
                                "usemtl baked\nf 1 2 3\nusemtl lit\nf 2 3 1\nusemtl plain\nf 3 1 2\n");
  const std::vector<Material> materials = load(obj).scene.objects.at(0).mesh.materials;
  for (const Material& material : materials) EXPECT_EQ(material.unlit, material.name == "baked") << material.name;
  EXPECT_GE(materials.size(), 3U);
}

TEST(SceneFile, ReadsTheOriginalsRoomAndFootball) {
  const auto room = test::test_data("mesh/flying_room/flying_room.obj");
  const auto ball = test::test_data("mesh/football/americanfootball.obj");
  if (!room || !ball) GTEST_SKIP() << "the folder ESIM_TEST_DATA does not contain mesh/";
  const SceneFile file = load(*room);
  EXPECT_EQ(file.scene.objects.at(0).mesh.triangles.size(), 1006U);
  EXPECT_EQ(file.image_count, 5U);

  Warnings warnings;
  const SceneFile football = load_scene_file(*ball, warnings.handler());
  EXPECT_EQ(football.image_count, 1U);
  ASSERT_EQ(warnings.texts.size(), 1U);
  EXPECT_NE(warnings.texts[0].find("normal or bump map"), std::string::npos) << warnings.texts[0];
}

}  // namespace
}  // namespace esim
