#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "esim/scene/scene_file.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// A static cube, a cube that translates and rotates, and a moving camera, in every format.
constexpr const char* kScript = R"python(
import math, os, sys
import bpy

folder = sys.argv[sys.argv.index("--") + 1]
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 24
scene.frame_end = 49
bpy.ops.mesh.primitive_cube_add(size=2, location=(1, 2, 3))
still = bpy.context.object
still.rotation_euler = (0, 0, 0.3)
still.scale = (1, 2, 0.5)
bpy.ops.mesh.primitive_cube_add(size=1)
mover = bpy.context.object
mover.name = "Mover"
for frame, x, yaw in ((1, 0, 0), (25, 2, 1), (49, 3, 0)):
    mover.location = (x, 0, 1)
    mover.rotation_euler = (0, 0, yaw)
    mover.keyframe_insert("location", frame=frame)
    mover.keyframe_insert("rotation_euler", frame=frame)
lens = bpy.data.cameras.new("Lens")
lens.angle = math.radians(60)
camera = bpy.data.objects.new("Eye", lens)
scene.collection.objects.link(camera)
camera.rotation_euler = (math.pi / 2, 0, -math.pi / 2)
camera.location = (-5, 0, 1)
camera.keyframe_insert("location", frame=1)
camera.location = (-5, 1, 1)
camera.keyframe_insert("location", frame=49)
scene.camera = camera
scene.frame_set(1)
path = lambda name: os.path.join(folder, name)
bpy.ops.export_scene.gltf(filepath=path("a.glb"), export_format="GLB", export_cameras=True)
bpy.ops.export_scene.gltf(filepath=path("b.gltf"), export_format="GLTF_SEPARATE", export_cameras=True)
bpy.ops.export_scene.fbx(filepath=path("c.fbx"))
bpy.ops.wm.obj_export(filepath=path("e.obj"), forward_axis="Y", up_axis="Z")
bpy.ops.export_mesh.ply(filepath=path("f.ply"))
bpy.ops.wm.collada_export(filepath=path("d.dae"))
)python";

class BlenderFormats : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (std::system("command -v blender > /dev/null") != 0) return;
    folder_ = new test::TemporaryDirectory;
    const auto script = folder_->write("export.py", kScript);
    const std::string command =
        "PATH=/usr/bin:/bin:$PATH blender --background --factory-startup --python-exit-code 3 --python " +
        script.string() + " -- " + folder_->path().string() + " > /dev/null 2>&1";
    exported_ = std::system(command.c_str()) == 0;
  }
  static void TearDownTestSuite() { delete std::exchange(folder_, nullptr); }

  void SetUp() override {
    if (folder_ == nullptr) GTEST_SKIP() << "Blender is missing; apt install blender";
    ASSERT_TRUE(exported_) << "Blender could not export";
  }

  static SceneFile load(const std::string& name) {
    return load_scene_file(folder_->path() / name, [](const std::string& text) { ADD_FAILURE() << text; });
  }

  inline static test::TemporaryDirectory* folder_ = nullptr;
  inline static bool exported_ = false;
};

/// Corners of a cube of side `size`, scaled, rotated about z and translated.
std::vector<Eigen::Vector3d> cube(double size, const Eigen::Vector3d& scale, double yaw, const Eigen::Vector3d& at) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitZ());
    corners.emplace_back(turn * (size * corner).cwiseProduct(scale) + at);
  }
  return corners;
}

double distance(const Eigen::Vector3d& point, const std::vector<Eigen::Vector3d>& others) {
  double min = 1e9;
  for (const Eigen::Vector3d& other : others) min = std::min(min, (point - other).norm());
  return min;
}

void expect_same_points(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b,
                        const std::string& name) {
  for (const Eigen::Vector3d& point : a) EXPECT_LT(distance(point, b), 1e-5) << name << ": " << point.transpose();
  for (const Eigen::Vector3d& point : b) EXPECT_LT(distance(point, a), 1e-5) << name << ": " << point.transpose();
}

std::vector<Eigen::Vector3d> vertices_at(const Mesh& mesh, const SE3& pose) {
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3f& vertex : mesh.vertices) vertices.push_back(pose * vertex.cast<double>());
  return vertices;
}

const ScenePose& pose_after(const SceneMotion& motion, double seconds) {
  const auto found = std::find_if(motion.begin(), motion.end(), [&](const ScenePose& pose) {
    return std::abs(to_seconds(pose.t - motion.front().t) - seconds) < 1e-4;
  });
  return found != motion.end() ? *found : motion.front();
}

TEST_F(BlenderFormats, TheWorldIsBlendersInMetres) {
  const auto still = cube(2, {1, 2, 0.5}, 0.3, {1, 2, 3});
  for (const char* const name : {"a.glb", "b.gltf", "c.fbx", "d.dae"}) {
    const SceneFile file = load(name);
    ASSERT_EQ(file.scene.objects.size(), 2U) << name;
    expect_same_points(vertices_at(file.scene.objects[0].mesh, {}), still, name);
    const Mesh& mover = file.scene.objects[1].mesh;
    expect_same_points(vertices_at(mover, file.motions.at(0).front().T_world_object), cube(1, {1, 1, 1}, 0, {0, 0, 1}),
                       name);
    expect_same_points(vertices_at(mover, pose_after(file.motions[0], 1).T_world_object),
                       cube(1, {1, 1, 1}, 1, {2, 0, 1}), name);
    EXPECT_NEAR(to_seconds(file.animation.end - file.animation.start), 2, 1e-6) << name;
    EXPECT_FALSE(mover.normals.empty()) << name;
  }
  auto both = still;
  for (const Eigen::Vector3d& corner : cube(1, {1, 1, 1}, 0, {0, 0, 1})) both.push_back(corner);
  for (const char* const name : {"e.obj", "f.ply"}) {
    expect_same_points(vertices_at(load(name).scene.objects.at(0).mesh, {}), both, name);
  }
}

TEST_F(BlenderFormats, CamerasLookWhereBlendersDo) {
  for (const char* const name : {"a.glb", "b.gltf", "c.fbx", "d.dae"}) {
    const SceneFile file = load(name);
    ASSERT_EQ(file.cameras.size(), 1U) << name;
    EXPECT_NEAR(file.cameras[0].horizontal_fov_rad.value_or(0), std::numbers::pi / 3, 1e-5) << name;
    const SE3 first = file.cameras[0].motion.front().T_world_object,
              last = file.cameras[0].motion.back().T_world_object;
    EXPECT_LT(test::largest_difference(first.translation, Eigen::Vector3d(-5, 0, 1)), 1e-5) << name;
    EXPECT_LT(test::largest_difference(last.translation, Eigen::Vector3d(-5, 1, 1)), 1e-5) << name;
    EXPECT_LT(test::largest_difference(first.rotation * Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX()), 1e-5)
        << name;
    EXPECT_LT(test::largest_difference(first.rotation * Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitZ()), 1e-5)
        << name;
  }
}

}  // namespace
}  // namespace esim
