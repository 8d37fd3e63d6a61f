#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"
#include "esim/scene/deformation/adapted.h"
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

/// In glTF y points up, in esim z.
Eigen::Vector3d from_gltf(const Eigen::Vector3d& v) { return {v.x(), -v.z(), v.y()}; }

const SceneObject& object_named(const SceneFile& file, const std::string& name) {
  for (const SceneObject& object : file.scene.objects) {
    if (object.name == name) return object;
  }
  throw std::runtime_error("no object " + name);
}

DeformedVertices vertices_at(const SceneObject& object, double t_s) {
  DeformedVertices vertices;
  object.deformation->evaluate(to_ns(t_s), vertices);
  const Eigen::AlignedBox3f bounds = object.deformation->bounds(to_ns(t_s));
  for (const Eigen::Vector3f& vertex : vertices.positions) EXPECT_TRUE(bounds.contains(vertex)) << vertex.transpose();
  return vertices;
}

double largest_difference(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3d>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, test::largest_difference(a[i].cast<double>(), from_gltf(b[i])));
  return largest;
}

/// Times inside the intervals between the keys of figures, before the first and after the last.
std::vector<double> some_times() {
  std::vector<double> times = {-1, 0, 0.3, 1.2, 2};
  for (double t_s = 0.013; t_s < 1.2; t_s += 0.037) times.push_back(t_s);
  return times;
}

struct FigureCase {
  std::size_t joints, influences, targets;
};

class SkinnedFigures : public testing::TestWithParam<FigureCase> {};

TEST_P(SkinnedFigures, FollowTheSpecification) {
  const auto [joints, influences, targets] = GetParam();
  const SkinnedFigure figure(7, joints, 60, targets, influences);
  const Loaded loaded = load(figure.glb());
  EXPECT_EQ(loaded.warnings, std::vector<std::string>());
  ASSERT_EQ(loaded.file.scene.objects.size(), 1U);
  const SceneObject& object = loaded.file.scene.objects[0];
  EXPECT_EQ(object.name, "figure");
  EXPECT_TRUE(object.moves);
  ASSERT_EQ(loaded.file.motions.size(), 1U);
  EXPECT_EQ(loaded.file.motions[0].size(), 1U);
  EXPECT_EQ(object.deformation->span().end, loaded.file.animation.end);
  EXPECT_LT(largest_difference(object.mesh.vertices, figure.shape(0).positions), 2e-5);

  double size = 0;
  for (const Eigen::Vector3d& position : figure.shape(0).positions) size = std::max(size, position.norm());
  for (const double t_s : some_times()) {
    const DeformedVertices there = vertices_at(object, t_s);
    const SkinnedFigure::Shape expected = figure.shape(t_s);
    // A blend of single-precision matrices: a few roundings of 6e-8 relative to the coordinates.
    EXPECT_LT(largest_difference(there.positions, expected.positions), 2e-6 * (1 + size)) << t_s;
    EXPECT_LT(largest_difference(there.normals, expected.normals), 1e-4) << t_s;
    if (t_s == 0 || t_s == 0.3 || t_s == 1.2) continue;  // where the derivative jumps
    constexpr double kStep_s = 1e-6;
    const auto before = figure.shape(t_s - kStep_s).positions, after = figure.shape(t_s + kStep_s).positions;
    std::vector<Eigen::Vector3d> velocities;
    for (std::size_t i = 0; i < before.size(); ++i) velocities.emplace_back((after[i] - before[i]) / (2 * kStep_s));
    EXPECT_LT(largest_difference(there.velocities, velocities), 1e-4) << t_s;
  }
}

INSTANTIATE_TEST_SUITE_P(Deformation, SkinnedFigures,
                         testing::Values(FigureCase{1, 1, 0}, FigureCase{2, 1, 0}, FigureCase{6, 4, 0},
                                         FigureCase{20, 8, 0}, FigureCase{5, 3, 1}, FigureCase{9, 11, 4}));

/// A triangle in the plane of x and y whose single morph target moves its vertex 1 by (0, 0, 1).
GlbWriter morphing(Json node = Json::object()) {
  GlbWriter glb;
  const std::size_t mesh = glb.add_triangle();
  glb.json["meshes"][mesh]["primitives"][0]["targets"] = {{{"POSITION", glb.sparse(3, {1}, {0, 0, 1})}}};
  node["name"] = "face";
  node["mesh"] = mesh;
  glb.add_node(node);
  return glb;
}

/// The offset of vertex 1 of the only object, from its position at rest, along the target's direction.
double morph_at(const Loaded& loaded, double t_s) {
  return -double{vertices_at(loaded.file.scene.objects.at(0), t_s).positions[1].y()};
}

double morph_rate_at(const Loaded& loaded, double t_s) {
  return -double{vertices_at(loaded.file.scene.objects.at(0), t_s).velocities[1].y()};
}

TEST(Deformation, WeightsInterpolateAsTheFileSays) {
  GlbWriter linear = morphing(), step = morphing(), cubic = morphing();
  linear.animate(0, "weights", {0, 1, 3}, {0, 1, 0});
  step.animate(0, "weights", {0, 1}, {0.25F, 1}, "STEP");
  // Slope 2 at the beginning, 0 at the end: 2 s - s^2.
  cubic.animate(0, "weights", {0, 1}, {9, 0, 2, 0, 1, 9}, "CUBICSPLINE");
  const Loaded loaded = load(linear);
  EXPECT_EQ(loaded.warnings, std::vector<std::string>());
  EXPECT_NEAR(morph_at(loaded, 0.25), 0.25, 1e-6);
  EXPECT_NEAR(morph_rate_at(loaded, 0.25), 1, 1e-6);
  EXPECT_NEAR(morph_rate_at(loaded, 2), -0.5, 1e-6);
  EXPECT_NEAR(morph_at(load(step), 0.75), 0.25, 1e-6);
  EXPECT_EQ(morph_rate_at(load(step), 0.75), 0);
  EXPECT_NEAR(morph_at(load(cubic), 0.25), 0.5 - 0.0625, 1e-6);
  EXPECT_NEAR(morph_rate_at(load(cubic), 0.25), 2 - 0.5, 1e-6);
}

TEST(Deformation, ConstantWeightsShapeAStaticMesh) {
  GlbWriter of_mesh = morphing(), of_node = morphing({{"weights", {0.5}}});
  of_mesh.json["meshes"][0]["weights"] = of_node.json["meshes"][0]["weights"] = {0.25};
  const Loaded first = load(of_mesh), second = load(of_node);
  ASSERT_EQ(first.file.scene.objects.size(), 1U);
  EXPECT_FALSE(first.file.scene.objects[0].moves);
  EXPECT_FLOAT_EQ(first.file.scene.objects[0].mesh.vertices[1].y(), -0.25F);
  EXPECT_FLOAT_EQ(second.file.scene.objects[0].mesh.vertices[1].y(), -0.5F);
}

TEST(Deformation, AMorphingMeshFollowsItsMovingNode) {
  GlbWriter glb = morphing({{"scale", {2, 2, 2}}});
  glb.animate(0, "weights", {0, 1}, {0, 1});
  glb.animate(0, "translation", {0, 1}, {0, 0, 0, 4, 0, 0});
  const Loaded loaded = load(glb);
  ASSERT_EQ(loaded.file.motions.size(), 1U);
  EXPECT_GT(loaded.file.motions[0].size(), 2U);
  for (const ScenePose& pose : loaded.file.motions[0]) {
    const double t_s = to_seconds(pose.t);
    const DeformedVertices there = vertices_at(loaded.file.scene.objects.at(0), t_s);
    const Eigen::Vector3d in_world = pose.T_world_object * there.positions[1].cast<double>();
    EXPECT_LT(test::largest_difference(in_world, from_gltf({4 * t_s + 2, 0, 2 * t_s})), 1e-5) << t_s;
    // The pose has the motion of the node, so that only that of the target remains.
    const Eigen::Vector3d rate = pose.T_world_object.rotation * there.velocities[1].cast<double>();
    EXPECT_LT(test::largest_difference(rate, from_gltf({0, 0, t_s < 1 ? 2.0 : 0.0})), 1e-5) << t_s;
  }
}

TEST(Deformation, AnimatedScaleDeforms) {
  GlbWriter glb;
  const std::size_t child = glb.add("nodes", {{"mesh", glb.add_triangle()}, {"translation", {1, 0, 0}}});
  const std::size_t node = glb.add_node({{"name", "balloon"}, {"children", {child}}});
  glb.animate(node, "scale", {0, 1}, {0, 0, 0, 2, 4, 2});
  glb.animate(node, "translation", {0, 1}, {0, 0, 0, 0, 0, 1});
  const Loaded loaded = load(glb);
  EXPECT_EQ(loaded.warnings, std::vector<std::string>());
  const SceneObject& object = object_named(loaded.file, "balloon");
  EXPECT_EQ(loaded.file.motions.at(0).size(), 1U);
  const DeformedVertices there = vertices_at(object, 0.25);
  EXPECT_LT(test::largest_difference(there.positions[1].cast<double>(), from_gltf({2 * 0.5, 0, 0.25})), 1e-6);
  EXPECT_LT(test::largest_difference(there.velocities[1].cast<double>(), from_gltf({4, 0, 1})), 1e-6);
}

TEST(Deformation, RestingJointsShapeAStaticMesh) {
  SkinnedFigure figure(3, 4, 12, 0, 4);
  GlbWriter glb = figure.glb();
  glb.json.erase("animations");
  for (Json& node : glb.json["nodes"]) {
    if (node["name"] == "joint") node["translation"] = {0, 1, 0};
  }
  const Loaded loaded = load(glb);
  ASSERT_EQ(loaded.file.scene.objects.size(), 1U);
  EXPECT_FALSE(loaded.file.scene.objects[0].moves);
  for (auto& joint : figure.joints) {
    joint.translations.assign(SkinnedFigure::kKeys, {0, 1, 0});
    joint.scales.assign(SkinnedFigure::kKeys, Eigen::Vector3d::Ones());
    joint.rotations.assign(SkinnedFigure::kKeys, Eigen::Quaterniond::Identity());
  }
  EXPECT_LT(largest_difference(loaded.file.scene.objects[0].mesh.vertices, figure.shape(0).positions), 1e-5);
}

TEST(Deformation, ASceneAsOneObjectPlaysAllAnimations) {
  SkinnedFigure figure(5, 4, 12, 2, 4);
  GlbWriter glb = figure.glb();
  const std::size_t prop = glb.add_node({{"name", "prop"}, {"mesh", glb.add_triangle()}});
  glb.animate(prop, "translation", {0, 1}, {0, 0, 0, 4, 0, 0});
  const test::TemporaryDirectory folder;
  const SceneObject object = load_scene_object(
      folder.write("hero.glb", glb.bytes()), [](const std::string&) {}, SceneLook::luminance);
  ASSERT_NE(object.deformation, nullptr);
  const DeformedVertices there = vertices_at(object, 0.5);
  ASSERT_EQ(there.positions.size(), 12U + 3U);
  const std::vector<Eigen::Vector3f> skinned(there.positions.begin(), there.positions.begin() + 12);
  EXPECT_LT(largest_difference(skinned, figure.shape(0.5).positions), 1e-5);
  EXPECT_LT(test::largest_difference(there.positions[13].cast<double>(), from_gltf({3, 0, 0})), 1e-5);
  EXPECT_LT(test::largest_difference(there.velocities[13].cast<double>(), from_gltf({4, 0, 0})), 1e-5);
}

TEST(Deformation, ClocksShiftStretchAndRepeat) {
  GlbWriter glb = morphing();
  glb.animate(0, "weights", {1, 2}, {0, 1});
  const std::shared_ptr<const Deformation> original = load(glb).file.scene.objects.at(0).deformation;
  const auto offset_at = [](const Deformation& deformation, double t_s) {
    DeformedVertices vertices;
    deformation.evaluate(to_ns(t_s), vertices);
    return std::pair(-double{vertices.positions[1].y()}, -double{vertices.velocities[1].y()});
  };
  using Pair = std::pair<double, double>;
  const auto once = retimed(original, {to_ns(10), 2, to_ns(0.25), false});
  EXPECT_EQ(once->span().start, to_ns(10));
  EXPECT_EQ(once->span().end, to_ns(11.5));
  EXPECT_EQ(offset_at(*once, 9), Pair(0.25, 0));
  EXPECT_EQ(offset_at(*once, 10.5), Pair(0.5, 0.5));
  EXPECT_EQ(offset_at(*once, 12), Pair(1, 0));
  const auto again = retimed(original, {to_ns(10), 2, to_ns(0.25), true});
  EXPECT_GT(again->span().end, to_ns(1e9));
  EXPECT_EQ(offset_at(*again, 10.5), Pair(0.5, 0.5));
  EXPECT_EQ(offset_at(*again, 12), Pair(0.25, 0.5));
  EXPECT_EQ(offset_at(*again, 10 + 2 * 1000 + 0.5), Pair(0.5, 0.5));
  EXPECT_EQ(offset_at(*scaled(again, 4), 10.5), Pair(2, 2));
  // A clock that begins at the start of the animation changes nothing.
  for (double t_s = 0.9; t_s < 2.2; t_s += 0.05)
    EXPECT_EQ(offset_at(*retimed(original, {to_ns(1)}), t_s), offset_at(*original, t_s)) << t_s;
}

TEST(Deformation, AnAnimationOfTheSameNodesIsLeftOut) {
  GlbWriter glb = morphing();
  glb.animate(0, "weights", {0, 1}, {0, 1});
  glb.animate(0, "weights", {0, 2}, {0, 0.5F});
  glb.json["animations"][1]["name"] = "second";
  const Loaded loaded = load(glb);
  ASSERT_EQ(loaded.warnings.size(), 1U);
  EXPECT_TRUE(test::contains(loaded.warnings[0], "animation second"));
  EXPECT_EQ(loaded.file.animation.end, kNsPerSecond);
}

TEST(Deformation, AnObjectPlaysTheAnimationOfAName) {
  GlbWriter glb = morphing();
  for (const auto& [name, end_s] : {std::pair{"Idle", 1.0F}, {"Run", 2.0F}, {"Run", 3.0F}}) {
    const bool again = end_s == 3;  // an animation of the same name that moves something else
    glb.animate(again ? glb.add_node({{"name", "prop"}, {"mesh", glb.add_triangle()}}) : 0,
                again ? "translation" : "weights", {0, end_s},
                again ? std::vector<float>{0, 0, 0, 1, 0, 0} : std::vector<float>{0, 1});
    glb.json["animations"].back()["name"] = name;
  }
  const test::TemporaryDirectory folder;
  const auto load_playing = [&](const char* file, const std::string& animation) {
    std::vector<std::string> warnings;
    const auto warn = [&](const std::string& text) { warnings.push_back(text); };
    const SceneObject object =
        load_scene_object(folder.path() / file, warn, SceneLook::luminance, SurfaceModel::matte, animation);
    EXPECT_EQ(warnings.size(), animation.empty() ? 1U : 0U);
    return object.deformation->span().end;
  };
  folder.write("hero.glb", glb.bytes());
  EXPECT_EQ(load_playing("hero.glb", "Idle"), to_ns(1));
  EXPECT_EQ(load_playing("hero.glb", "Run"), to_ns(3));
  EXPECT_EQ(load_playing("hero.glb", ""), to_ns(3));  // Idle and the second Run, which move different nodes
  const auto reason = [&](const char* file, const char* animation) {
    return test::message_of<UserError>([&] { load_playing(file, animation); });
  };
  EXPECT_TRUE(test::contains(reason("hero.glb", "Walk"), "has no animation Walk; it has Idle, Run"));
  folder.write("still.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_TRUE(test::contains(reason("still.obj", "Run"), "only those of glTF files have names"));
}

// --- damaged files ---------------------------------------------------------------------------------------------------

/// A triangle with two joints, whose weights are given.
GlbWriter two_joints(const std::vector<float>& weights, std::uint8_t second_joint = 1) {
  GlbWriter glb;
  const std::size_t mesh = glb.add_triangle();
  Json& attributes = glb.json["meshes"][mesh]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = glb.joints({0, second_joint, 0, 0, 0, second_joint, 0, 0, 0, second_joint, 0, 0});
  attributes["WEIGHTS_0"] = glb.floats(weights, "VEC4");
  const std::size_t a = glb.add_node({{"name", "a"}}), b = glb.add_node({{"name", "b"}});
  glb.animate(b, "translation", {0, 1}, {0, 0, 0, 0, 3, 0});
  glb.add_node({{"name", "figure"}, {"mesh", mesh}, {"skin", glb.add("skins", {{"joints", {a, b}}})}});
  return glb;
}

const std::vector<float> kHalves = {0.5F, 0.5F, 0, 0, 0.5F, 0.5F, 0, 0, 0.5F, 0.5F, 0, 0};

/// The heights of the vertices at the end, when joint b has risen by 3.
std::vector<float> heights(const GlbWriter& glb) {
  std::vector<float> result;
  const Loaded loaded = load(glb);
  for (const Eigen::Vector3f& position : vertices_at(object_named(loaded.file, "figure"), 1).positions)
    result.push_back(position.z());
  return result;
}

TEST(Deformation, MissingInverseBindMatricesAreIdentities) {
  EXPECT_EQ(load(two_joints(kHalves)).warnings, std::vector<std::string>());
  EXPECT_EQ(heights(two_joints(kHalves)), std::vector<float>({1.5F, 1.5F, 2.5F}));
}

TEST(Deformation, FaultyWeightsAreRepairedWithAWarning) {
  const GlbWriter twice = two_joints({1, 1, 0, 0, 0.5F, 0.5F, 0, 0, 0.5F, 0.5F, 0, 0});
  EXPECT_TRUE(test::contains(load(twice).warnings.at(0), "of 1 vertices do not have the sum 1"));
  EXPECT_EQ(heights(twice), std::vector<float>({1.5F, 1.5F, 2.5F}));
  const GlbWriter none = two_joints({0, 0, 0, 0, 0.5F, 0.5F, 0, 0, 0.5F, 0.5F, 0, 0});
  EXPECT_TRUE(test::contains(load(none).warnings.at(0), "1 vertices have no joint"));
  EXPECT_EQ(heights(none), std::vector<float>({0, 1.5F, 2.5F}));
  const GlbWriter negative = two_joints({-1, 1, 0, 0, 0.5F, 0.5F, 0, 0, 0.5F, 0.5F, 0, 0});
  EXPECT_TRUE(test::contains(load(negative).warnings.at(0), "1 weights of joints are negative"));
  EXPECT_EQ(heights(negative), std::vector<float>({3, 1.5F, 2.5F}));
}

TEST(Deformation, DamagedSkinsAreRefused) {
  EXPECT_TRUE(test::contains(refusal(two_joints(kHalves, 2)), "refers to joint 2 of 2"));
  std::vector<float> not_finite = kHalves;
  not_finite[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(test::contains(refusal(two_joints(not_finite)), "not finite"));
  GlbWriter outside = two_joints(kHalves);
  outside.json["scenes"][0]["nodes"] = {1, 2};
  EXPECT_TRUE(test::contains(refusal(outside), "not a node of the scene"));
  GlbWriter empty = two_joints(kHalves);
  empty.json["skins"][0]["joints"] = Json::array();
  EXPECT_TRUE(test::contains(refusal(empty), "has no joints"));
  GlbWriter few = two_joints(kHalves);
  few.json["skins"][0]["inverseBindMatrices"] = few.floats(std::vector<float>(16), "MAT4");
  EXPECT_TRUE(test::contains(refusal(few), "2 joints, but 1 inverse bind matrices"));
  GlbWriter loop = two_joints(kHalves);
  loop.json["nodes"][0]["children"] = {1};
  loop.json["nodes"][1]["children"] = {0};
  EXPECT_TRUE(test::contains(refusal(loop), "two parents"));
  GlbWriter missing = two_joints(kHalves);
  missing.json["nodes"][2]["skin"] = 4;
  EXPECT_TRUE(test::contains(refusal(missing), "skin is not one of the 1 skins"));

  GlbWriter singular = two_joints(kHalves);
  std::vector<float> flat(32);
  flat[0] = flat[5] = flat[15] = flat[16] = flat[21] = flat[26] = flat[31] = 1;
  singular.json["skins"][0]["inverseBindMatrices"] = singular.floats(flat, "MAT4");
  EXPECT_TRUE(test::contains(load(singular).warnings.at(0), "1 inverse bind matrices are singular"));
}

TEST(Deformation, DamagedMorphTargetsAreRefused) {
  GlbWriter short_target = morphing();
  short_target.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = short_target.floats({0, 0, 0}, "VEC3");
  EXPECT_TRUE(test::contains(refusal(short_target), "1 offsets for a primitive of 3 vertices"));
  GlbWriter weights = morphing({{"weights", {1, 2}}});
  EXPECT_TRUE(test::contains(refusal(weights), "weights is not a list of 1"));
  GlbWriter keys = morphing();
  keys.animate(0, "weights", {0, 1}, {0, 1, 2});
  EXPECT_TRUE(test::contains(refusal(keys), "one value per time"));
  GlbWriter backwards = morphing();
  backwards.animate(0, "weights", {1, 1}, {0, 1});
  EXPECT_TRUE(test::contains(refusal(backwards), "must increase"));
  GlbWriter place = morphing();
  place.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = place.sparse(3, {3}, {0, 0, 1});
  EXPECT_TRUE(test::contains(refusal(place), "a missing element"));
  GlbWriter huge = morphing();
  huge.json["accessors"][huge.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"].get<std::size_t>()]
           ["count"] = 4'000'000'000U;
  EXPECT_TRUE(test::contains(refusal(huge), "elements without data"));
  GlbWriter infinite = morphing();
  infinite.animate(0, "weights", {0, 1}, {0, 3e38F});
  infinite.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = infinite.sparse(3, {1}, {0, 0, 3e38F});
  EXPECT_TRUE(test::contains(refusal(infinite), "not finite"));
}

}  // namespace
}  // namespace esim
