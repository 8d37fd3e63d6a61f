#pragma once

#include <gtest/gtest.h>

#include <fstream>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim::test {

/// A grey wall 3 m before a camera at rest, and a white card 2 m before it that crosses the view at 2 m/s.
class CardScene : public testing::Test {
 protected:
  CardScene() {
    write_square("wall.obj", 40, 0.2);
    write_square("card.obj", 0.4, 1.0);
    folder_.write("card.txt", "0 -1 -1 0 0 0 0 1\n0.5 -1 0 0 0 0 0 1\n1 -1 1 0 0 0 0 1\n");
    MeshRendererOptions mesh;
    mesh.scene = folder_.path() / "wall.obj";
    FileTrajectoryOptions path;
    path.path = folder_.path() / "card.txt";
    mesh.objects = {{"card", folder_.path() / "card.obj", 1.0, path}};
    scenario_.renderer = mesh;
    StaticTrajectoryOptions still;
    still.pose.position = {-3, 0, 0};
    scenario_.trajectory = still;
    CameraOptions camera;
    camera.name = "cam0";
    camera.width = 64, camera.height = 48;
    camera.horizontal_fov_deg = 40;
    scenario_.cameras = {camera};
  }

  MeshRendererOptions& mesh() { return std::get<MeshRendererOptions>(scenario_.renderer); }

  Summary simulate_into(Sink& out, int threads) {
    World world = build_world(scenario_, threads, {[](const std::string&) {}, [](const std::string&) {}});
    return simulate(world, out, [](const Progress&) { return true; });
  }

  /// Why the scenario is refused.
  std::string error() {
    return message_of<UserError>([&] {
      build_world(scenario_, 1, {[&](const std::string& line) { warnings_ += line; }, [](const std::string&) {}});
    });
  }

  TemporaryDirectory folder_;
  Scenario scenario_;
  std::string warnings_;

 private:
  /// A square of one grey in the plane x = 0, `side` metres wide.
  void write_square(const std::string& name, double side, double grey) const {
    const std::string h = std::to_string(side / 2), kd = std::to_string(grey);
    folder_.write(name, "mtllib " + name + ".mtl\nv 0 -" + h + " -" + h + "\nv 0 " + h + " -" + h + "\nv 0 " + h + " " +
                            h + "\nv 0 -" + h + " " + h + "\nusemtl m\nf 1 2 3\nf 1 3 4\n");
    folder_.write(name + ".mtl", "newmtl m\nKd " + kd + " " + kd + " " + kd + "\n");
  }
};

}  // namespace esim::test
