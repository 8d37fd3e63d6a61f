// When the deformations of a scenario's scene files are played.
#include <gtest/gtest.h>

#include <cmath>

#include "esim/compose/compose.h"
#include "esim/motion/static.h"
#include "esim/scenario/read.h"
#include "scene/skinned_glb.h"
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

}  // namespace
}  // namespace esim
