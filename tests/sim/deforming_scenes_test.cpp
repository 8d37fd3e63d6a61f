// When the deformations of a scenario's scene files are played.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esim/compose/compose.h"
#include "esim/motion/static.h"
#include "esim/scenario/read.h"
#include "scene/skinned_glb.h"
#include "scene/vertex_writer.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// The largest distance of an object's vertices from the figure's at a time of its own animation.
double distance_from_figure(const SceneObject& object, TimeNs t, const test::SkinnedFigure& figure, double own_s,
                            double scale) {
  DeformedVertices vertices;
  object.deformation->evaluate(t, vertices);
  const std::vector<Eigen::Vector3d> expected = figure.shape(own_s).positions;
  double largest = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Eigen::Vector3d z_up(expected[i].x(), -expected[i].z(), expected[i].y());
    largest = std::max(largest, (vertices.positions[i].cast<double>() - scale * z_up).norm());
  }
  return largest;
}

TEST(DeformingScenes, PlayFromTheStartOfTheBodysTrajectory) {
  const test::SkinnedFigure figure(5, 4, 30, 1, 4);
  const test::TemporaryDirectory folder;
  folder.write("figure.glb", figure.glb().bytes());
  const Scenario scenario = read_scenario(folder.write("scenario.yaml", R"(
renderer:
  type: mesh
  scene: figure.glb
  time_scale: 2
  objects:
    - {name: slow, scene: figure.glb, trajectory: {type: static}, animation: {time_scale: 3, offset_s: 0.25}}
    - {name: again, scene: figure.glb, scale: 2, trajectory: {type: static}, animation: {repeat: true}}
trajectory: {type: static}
duration_s: 10
camera: {width: 32, height: 24, horizontal_fov_deg: 90}
)"));
  const auto ignore = [](const std::string&) {};
  SceneFile file = load_scenes(scenario, SceneLook::luminance, {ignore, ignore});
  const TimeSpan span{to_ns(5), to_ns(15)};
  const StaticTrajectory body(SE3{}, span.start, span.end - span.start);
  EXPECT_EQ(build_object_trajectories(scenario, file, body, span, {ignore, ignore}).size(), 3U);
  play_deformations(scenario, body.start(), file);
  ASSERT_EQ(file.scene.objects.size(), 3U);
  for (const double since_s : {0.0, 0.3, 1.1, 4.7}) {
    const TimeNs t = to_ns(5 + since_s);
    const auto& objects = file.scene.objects;
    EXPECT_LT(distance_from_figure(objects[0], t, figure, since_s / 2, 1), 2e-5) << since_s;
    EXPECT_LT(distance_from_figure(objects[1], t, figure, since_s / 3 + 0.25, 1), 2e-5) << since_s;
    EXPECT_LT(distance_from_figure(objects[2], t, figure, std::fmod(since_s, 1.2), 2), 4e-5) << since_s;
  }
}

/// A triangle of which vertex 2 rises by 1 m per frame, and its scenario with some objects.
class CachedScenes : public testing::Test {
 protected:
  CachedScenes() {
    test::Frames frames;
    for (int i = 0; i < 5; ++i) frames.push_back({{0, 0, 0}, {1, 0, 0}, {0, 1, static_cast<float>(i)}});
    folder_.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder_.write("a.pc2", test::pc2(frames));
    folder_.write("a.mdd", test::mdd(frames, {1, 2, 3, 4, 5}));
    for (int i = 0; i < 5; ++i)
      folder_.write("a_0" + std::to_string(i) + ".obj", "v 0 0 0\nv 1 0 0\nv 0 1 " + std::to_string(i) + "\nf 1 2 3\n");
  }

  Scenario scenario_of(const std::string& objects) const {
    return read_scenario(
        folder_.write("scenario.yaml", "renderer:\n  type: mesh\n  scene: a.obj\n  objects:\n" + objects +
                                           "trajectory: {type: static}\nduration_s: 10\n"
                                           "camera: {width: 32, height: 24, horizontal_fov_deg: 90}\n"));
  }

  std::string refusal(const std::string& object) const {
    const auto ignore = [](const std::string&) {};
    return test::message_of<UserError>([&] {
      load_scenes(scenario_of("    - " + object + "\n"), SceneLook::luminance, {ignore, ignore});
    });
  }

  test::TemporaryDirectory folder_;
};

TEST_F(CachedScenes, PlayAsAnimations) {
  const Scenario scenario = scenario_of(R"(
    - {name: cache, scene: a.obj, trajectory: {type: static}, vertices: {file: a.pc2, rate_hz: 4}}
    - {name: timed, scene: a.obj, trajectory: {type: static}, vertices: {file: a.mdd}, scale: 2, animation: {offset_s: 1.5}}
    - {name: meshes, scene: a.obj, trajectory: {type: static}, vertices: {file: "a_##.obj", rate_hz: 2}, animation: {time_scale: 3, repeat: true}}
    - {name: same, scene: a.obj, trajectory: {type: static}, vertices: {file: a.pc2, rate_hz: 4}}
    - {name: rests, scene: a.obj, trajectory: {type: static}}
)");
  const auto ignore = [](const std::string&) {};
  SceneFile file = load_scenes(scenario, SceneLook::luminance, {ignore, ignore});
  const TimeSpan span{to_ns(5), to_ns(15)};
  const StaticTrajectory body(SE3{}, span.start, span.end - span.start);
  EXPECT_EQ(build_object_trajectories(scenario, file, body, span, {ignore, ignore}).size(), 5U);
  ASSERT_EQ(file.scene.objects.size(), 6U);
  EXPECT_EQ(file.scene.objects[1].deformation, file.scene.objects[4].deformation);
  EXPECT_NE(file.scene.objects[1].deformation, file.scene.objects[3].deformation);
  EXPECT_EQ(file.scene.objects[5].deformation, nullptr);
  play_deformations(scenario, body.start(), file);
  const auto height = [&](std::size_t object, double since_s) {
    DeformedVertices vertices;
    file.scene.objects[object].deformation->evaluate(to_ns(5 + since_s), vertices);
    return std::pair(double{vertices.positions[2].z()}, double{vertices.velocities[2].z()});
  };
  for (const double since_s : {-1.0, 0.0, 0.3, 0.9, 1.7, 6.0, 8.0}) {
    const double since = std::max(0.0, since_s);
    EXPECT_NEAR(height(1, since_s).first, std::min(4.0, 4 * since), 1e-5) << since_s;
    EXPECT_NEAR(height(1, since_s).second, since_s < 0 || since_s >= 1 ? 0 : 4, 1e-4) << since_s;
    EXPECT_NEAR(height(2, since_s).first, 2 * std::min(4.0, 1.5 + since), 1e-5) << since_s;
    EXPECT_NEAR(height(3, since_s).first, std::fmod(since * 2 / 3, 4), 1e-5) << since_s;
    EXPECT_NEAR(height(3, since_s).second, since_s < 0 ? 0 : 2.0 / 3, 1e-4) << since_s;
  }
}

TEST_F(CachedScenes, ErrorsNameTheOptionOrTheFile) {
  EXPECT_TRUE(test::contains(refusal("{scene: a.obj, vertices: {rate_hz: 4}}"), "renderer.objects.0.vertices.file"));
  EXPECT_TRUE(test::contains(refusal("{scene: a.obj, vertices: {file: a.pc2, rate_hz: 0}}"), "vertices.rate_hz"));
  EXPECT_TRUE(test::contains(refusal("{scene: a.obj, vertices: {file: a.pc2, rate_hz: -1}}"), "vertices.rate_hz"));
  EXPECT_TRUE(test::contains(refusal("{scene: a.obj, vertices: {file: a.pc2, axes: z}}"), "same, y_up, left_handed"));
  EXPECT_TRUE(test::contains(refusal("{scene: a.obj, vertices: {file: a.pc2}}"), "set rate_hz"));
  EXPECT_TRUE(
      test::contains(refusal("{scene: a.obj, vertices: {file: none.pc2, rate_hz: 4}}"), "none.pc2: no such file"));
  EXPECT_TRUE(test::contains(refusal("{scene: a.blend, vertices: {file: a.mdd}}"), "a.blend"));
}

}  // namespace
}  // namespace esim
