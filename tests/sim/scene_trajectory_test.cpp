#include <gtest/gtest.h>

#include <fstream>

#include "../scene/glb_writer.h"
#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// A wall, a thing that moves along x by 2 m/s for 2 s, and cameras: one that follows it at the same speed, one that
/// stands.
std::string animated_scene() {
  test::GlbWriter glb;
  const std::size_t mesh = glb.add_triangle();
  glb.add_node({{"mesh", mesh}, {"translation", {-20, -20, -5}}, {"scale", {50, 50, 1}}});
  const std::size_t thing = glb.add_node({{"name", "thing"}, {"mesh", mesh}});
  glb.animate(thing, "translation", {1, 3}, {0, 0, 0, 4, 0, 0});
  glb.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"aspectRatio", 1.5}}}});
  const std::size_t drone = glb.add_node({{"name", "Drone"}, {"camera", 0}, {"translation", {0, 0, 3}}});
  glb.animate(drone, "translation", {1, 3}, {0, 0, 3, 4, 0, 3});
  glb.add_node({{"name", "Tripod"}, {"camera", 0}, {"translation", {0, 0, 3}}});
  return glb.bytes();
}

struct SceneWorld {
  test::TemporaryDirectory folder;
  std::vector<std::string> notes;

  SceneWorld() { folder.write("scene.glb", animated_scene()); }

  World build(const std::string& trajectory, const std::string& camera = "", const std::string& rest = "") {
    const auto file =
        folder.write("scenario.yaml", "renderer: {type: mesh, scene: scene.glb}\ntrajectory: " + trajectory +
                                          "\ncamera: {width: 60, height: 40" + camera + "}\n" + rest);
    return build_world(read_scenario(file), 1,
                       {[](const std::string& text) { ADD_FAILURE() << text; },
                        [&](const std::string& text) { notes.push_back(text); }});
  }
};

TEST(SceneTrajectory, CameraAndObjectsMoveAsInTheFile) {
  SceneWorld scene;
  const World world = scene.build("{type: scene, camera: Drone}");
  EXPECT_EQ(world.info.start, kNsPerSecond);
  EXPECT_EQ(world.info.end, 3 * kNsPerSecond);
  ASSERT_EQ(world.objects.size(), 1U);
  for (const double t_s : {1.0, 1.5, 2.2, 3.0}) {
    const Kinematics camera = world.trajectory->at(to_ns(t_s)), thing = world.objects[0]->at(to_ns(t_s));
    const double x = 2 * (t_s - 1);
    EXPECT_LT(test::largest_difference(camera.T_world_body.translation, Eigen::Vector3d(x, -3, 0)), 1e-5) << t_s;
    EXPECT_LT(test::largest_difference(camera.velocity_world, Eigen::Vector3d(2, 0, 0)), 1e-3) << t_s;
    EXPECT_LT(test::largest_difference(thing.T_world_body.translation, Eigen::Vector3d(x, 0, 0)), 1e-5) << t_s;
  }
  ASSERT_FALSE(scene.notes.empty());
  EXPECT_TRUE(test::contains(scene.notes[0], "2 triangles, 1 material, 0 textures; moving 1 object: thing"));
  EXPECT_TRUE(test::contains(scene.notes[0], "cameras: Drone"));
}

TEST(SceneTrajectory, TheFieldOfViewIsTheFilesUnlessGiven) {
  SceneWorld scene;
  const Camera camera = scene.build("{type: scene, camera: Tripod}").info.cameras[0].model;
  EXPECT_NEAR(camera.fx, 30 / (1.5 * std::tan(0.4)), 1e-4);
  const Camera given = scene.build("{type: scene, camera: Tripod}", ", horizontal_fov_deg: 90").info.cameras[0].model;
  EXPECT_NEAR(given.fx, 30, 1e-9);
}

TEST(SceneTrajectory, TimeCanBeStretched) {
  SceneWorld scene;
  const auto file = scene.folder.write("slow.yaml",
                                       "renderer: {type: mesh, scene: scene.glb, time_scale: 2}\n"
                                       "trajectory: {type: scene, camera: Drone}\ncamera: {width: 60, height: 40}\n");
  const World world = build_world(read_scenario(file), 1, {[](const std::string&) {}, [](const std::string&) {}});
  EXPECT_EQ(world.info.start, 2 * kNsPerSecond);
  EXPECT_EQ(world.info.end, 6 * kNsPerSecond);
  EXPECT_NEAR(world.trajectory->at(4 * kNsPerSecond).velocity_world.x(), 1, 1e-3);
  EXPECT_NEAR(world.objects[0]->at(4 * kNsPerSecond).velocity_world.x(), 1, 1e-3);
}

TEST(SceneTrajectory, AnAnimationBeginsWithOtherTrajectoriesAndRestsAfterItsEnd) {
  SceneWorld scene;
  const World world =
      scene.build("{type: static, pose: {position: [0, -3, 0], look_at: [0, 0, 0]}}", "", "duration_s: 5\n");
  EXPECT_NEAR(world.objects[0]->at(kNsPerSecond).T_world_body.translation.x(), 2, 1e-5);
  EXPECT_NEAR(world.objects[0]->at(4 * kNsPerSecond).T_world_body.translation.x(), 4, 1e-5);
  EXPECT_EQ(world.objects[0]->at(4 * kNsPerSecond).velocity_world.norm(), 0);
}

TEST(SceneTrajectory, SaysWhichCamerasThereAre) {
  SceneWorld scene;
  const auto message = [&](const std::string& trajectory) {
    return test::message_of<UserError>([&] { scene.build(trajectory); });
  };
  EXPECT_TRUE(test::contains(message("{type: scene, camera: Camera.001}"),
                             "no camera 'Camera.001'; name one of Drone, Tripod"));
  EXPECT_TRUE(test::contains(message("{type: scene}"), "several cameras; name one of Drone, Tripod"));
}

}  // namespace
}  // namespace esim
