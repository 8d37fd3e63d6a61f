#include "esim/compose/waypoint_trajectory.h"

#include <gtest/gtest.h>

#include "card_scene.h"
#include "esim/geometry/so3.h"
#include "esim/scenario/read.h"
#include "esim/scenario/waypoint_file.h"

namespace esim {
namespace {

using Eigen::Vector3d;
using test::contains;

WaypointPointOptions looking(const Vector3d& position, const Vector3d& at) {
  WaypointPointOptions point;
  point.position = position;
  point.look_at = at;
  return point;
}

/// A camera next to its body, with another orientation.
SE3 odd_mount() { return {so3_exp({0.7, -1.1, 0.4}), {0.3, -0.2, 0.5}}; }

TEST(WaypointAim, PutsTheTargetOnTheOpticalAxis) {
  for (const SE3& T_body_camera : {SE3{}, odd_mount()}) {
    for (const Vector3d& target : {Vector3d(4, 1, 2), Vector3d(-3, 2, -2), Vector3d(1, 2, 9), Vector3d(1.5, 2, 3.1)}) {
      for (const Vector3d& up : {Vector3d(0, 0, 1), Vector3d(0.3, -2, 0.5)}) {
        WaypointPointOptions point = looking({1, 2, 3}, target);
        point.up = up;
        if (target.head<2>() == point.position.head<2>() && up.z() == 1) continue;  // straight up
        if ((target - point.position).norm() < 0.6 && T_body_camera.translation.norm() > 0) continue;
        const SE3 T_world_camera = waypoints_of({point}, T_body_camera)[0].T_world_body * T_body_camera;
        const Vector3d seen = T_world_camera.inverse() * target;
        EXPECT_NEAR(seen.x() / seen.z(), 0, 1e-12);
        EXPECT_NEAR(seen.y() / seen.z(), 0, 1e-12);
        EXPECT_GT(seen.z(), 0);
        EXPECT_NEAR((T_world_camera.rotation * Vector3d::UnitX()).dot(up), 0, 1e-9) << "level";
        EXPECT_LT((T_world_camera.rotation * Vector3d::UnitY()).dot(up), 0) << "y downwards";
      }
    }
  }
}

TEST(WaypointAim, AgreesWithOtherPosesThatLookAtPoints) {
  const WaypointPointOptions point = looking({1, 2, 3}, {-2, 5, 4});
  EXPECT_LT(waypoints_of({point}, {})[0].T_world_body.rotation.angularDistance(pose_of(point).rotation), 1e-7);
}

TEST(WaypointAim, SaysWhatCannotBeAimed) {
  const auto error = [](const WaypointPointOptions& point, const SE3& T_body_camera = {}) {
    return test::message_of<UserError>([&] { waypoints_of({looking({0, 0, 0}, {1, 0, 0}), point}, T_body_camera); });
  };
  EXPECT_TRUE(contains(error({}), "points.1: has no orientation"));
  EXPECT_TRUE(contains(error(looking({1, 1, 1}, {1, 1, 1})), "points.1: look_at must differ from position"));
  EXPECT_TRUE(contains(error(looking({1, 1, 1}, {1, 1, 5})), "points.1: up must not point along the optical axis"));
  EXPECT_TRUE(contains(error(looking({0, 0, 0}, {0, 0.1, 0.1}), {{}, {0.5, 0, 0}}), "points.1: look_at is 0.141 m"));
  WaypointPointOptions both = looking({0, 0, 0}, {1, 0, 0});
  both.quaternion = Eigen::Vector4d(0, 0, 0, 1);
  EXPECT_TRUE(contains(error(both), "points.1: quaternion and look_at must not both"));
  WaypointPointOptions no_up = looking({0, 0, 0}, {1, 0, 0}), idle;
  no_up.up = Vector3d::Zero();
  EXPECT_TRUE(contains(error(no_up), "up must not be [0, 0, 0]"));
  idle.quaternion = Eigen::Vector4d(0, 0, 0, 1);
  idle.up = Vector3d::UnitZ();
  EXPECT_TRUE(contains(error(idle), "points.1: up has no effect without look_at"));
}

class WaypointScenario : public test::CardScene {
 protected:
  Scenario read(const std::string& trajectory, const std::string& camera = "") {
    return read_scenario(
        folder_.write("s.yaml", "renderer: {type: mesh, scene: wall.obj}\ncamera: {width: 64, height: 48" + camera +
                                    "}\ntrajectory: " + trajectory + "\n"));
  }
  World build(const Scenario& scenario) {
    return build_world(scenario, 1, {[](const std::string&) {}, [](const std::string&) {}});
  }
  std::string refused(const std::string& trajectory) {
    return test::message_of<UserError>([&] { build(read(trajectory)); });
  }
};

TEST_F(WaypointScenario, TheFirstCameraLooksAtTheTarget) {
  const World world =
      build(read("{type: waypoints, points: [{position: [-3, 0, 0], look_at: [0, 1, 0.5], t: 1}, "
                 "{position: [-2, 1, 0.3], look_at: [0, 1, 0.5], t: 3}]}",
                 ", T_body_camera: {position: [0.1, 0.2, 0], quaternion: [0.5, -0.5, 0.5, -0.5]}"));
  EXPECT_EQ(world.info.start, kNsPerSecond);
  EXPECT_EQ(world.info.end, 3 * kNsPerSecond);
  for (const TimeNs t : {world.info.start, world.info.end}) {
    const Vector3d seen = view(world, 0, t).camera.T_world_body.inverse() * Vector3d(0, 1, 0.5);
    EXPECT_NEAR(seen.x() / seen.z(), 0, 1e-9);
    EXPECT_NEAR(seen.y() / seen.z(), 0, 1e-9);
    EXPECT_GT(seen.z(), 1);
  }
  EXPECT_LT((world.trajectory->at(world.info.end).T_world_body.translation - Vector3d(-2, 1, 0.3)).norm(), 1e-12);
}

TEST_F(WaypointScenario, PointsMayStandInAFile) {
  folder_.write("walk.yaml",
                "points:\n"
                "  - {position: [-3, 0, 0], look_at: [0, 0, 0], pause_s: 0.25, speed: 2}\n"
                "  - {position: [-2, 0.1, 0.33333333333333331], look_at: [0, 0, 0]}\n");
  const Scenario scenario = read("{type: waypoints, file: walk.yaml, turn_deg_per_s: 90}");
  const auto& options = std::get<WaypointTrajectoryOptions>(scenario.trajectory);
  ASSERT_EQ(options.points.size(), 2U);
  EXPECT_EQ(options.points[0].pause_s, 0.25);
  EXPECT_EQ(options.points[0].speed, 2);
  EXPECT_EQ(options.points[1].position.z(), 1.0 / 3) << "to the last digit";

  // The recording's scenario holds the points themselves.
  const std::string full = write_scenario(scenario);
  EXPECT_FALSE(contains(full, "walk.yaml"));
  const Scenario again = read_scenario(folder_.write("full.yaml", full));
  EXPECT_EQ(write_scenario(again), full);
  const World world = build(scenario), same = build(again);
  EXPECT_EQ(world.info.end, same.info.end);
  EXPECT_EQ(world.trajectory->at(world.info.end / 2).T_world_body.matrix(),
            same.trajectory->at(same.info.end / 2).T_world_body.matrix());
}

TEST_F(WaypointScenario, ObjectsGoAlongThemToo) {
  WaypointTrajectoryOptions path;
  WaypointPointOptions point;
  point.quaternion = Eigen::Vector4d(0, 0, 0, 1);
  for (const double y : {-1.0, 1.0}) {
    point.position = {-1, y, 0};
    path.points.push_back(point);
  }
  mesh().objects[0].trajectory = path;
  scenario_.duration_s = 1;
  const World world = build(scenario_);
  EXPECT_NEAR(world.objects[0]->at(kNsPerSecond).T_world_body.translation.y(), -0.25, 1e-9);
}

TEST_F(WaypointScenario, SaysWhatIsWrongAndWhere) {
  const std::string a = "{position: [-3, 0, 0], look_at: [0, 0, 0]}", b = "{position: [-2, 0, 0], look_at: [0, 0, 0]}";
  EXPECT_TRUE(contains(refused("{type: waypoints}"), "s.yaml:3: trajectory: has no points"));
  EXPECT_TRUE(contains(refused("{type: waypoints, points: [" + a + "]}"), "trajectory: points: 1 point, but"));
  EXPECT_TRUE(contains(refused("{type: waypoints, points: [{position: [0, 0, 0], lookat: [1, 1, 1]}]}"),
                       "s.yaml:3: trajectory.points.0.lookat: unknown key; did you mean look_at?"));
  EXPECT_TRUE(
      contains(refused("{type: waypoints, points: [{position: [0, .nan, 0]}]}"), "trajectory.points.0.position"));
  EXPECT_TRUE(contains(refused("{type: waypoints, points: [" + a + ", " + a + "]}"),
                       "trajectory: points.1: has the same pose"));
  EXPECT_TRUE(contains(refused("{type: waypoints, file: none.yaml}"), "none.yaml: no such file of waypoints"));
  folder_.write("one.yaml", "points:\n  - " + a + "\n");
  EXPECT_TRUE(contains(refused("{type: waypoints, file: one.yaml}"), "one.yaml: points: 1 point, but"));
  EXPECT_TRUE(contains(refused("{type: waypoints, file: one.yaml, points: [" + a + ", " + b + "]}"),
                       "together with file; remove one"));
  folder_.write("list.yaml", "- " + a + "\n");
  EXPECT_TRUE(contains(refused("{type: waypoints, file: list.yaml}"), "list.yaml: has no waypoints"));
  folder_.write("more.yaml", "points:\n  - " + a + "\n  - " + b + "\nspeeed: 1\n");
  EXPECT_TRUE(contains(refused("{type: waypoints, file: more.yaml}"), "more.yaml:4: speeed: unknown key"));
}

TEST_F(WaypointScenario, DamagedFilesAreRefusedOrRead) {
  const std::string whole =
      "points:\n  - {position: [-3, 0, 0], look_at: [0, 0, 0]}\n  - {position: [-2, 0, 0], look_at: [0, 1, 0]}\n";
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    const auto file = folder_.write("cut.yaml", whole.substr(0, length));
    try {
      EXPECT_LE(read_waypoints(file).size(), 2U);
    } catch (const UserError& error) {
      EXPECT_TRUE(contains(error.what(), "cut.yaml"));
    }
  }
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(0x80 + i % 128);
    const auto file = folder_.write("bad.yaml", damaged);
    try {
      read_waypoints(file);
    } catch (const UserError& error) {
      EXPECT_TRUE(contains(error.what(), "bad.yaml"));
    }
  }
}

}  // namespace
}  // namespace esim
