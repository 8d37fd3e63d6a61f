#include "esim/studio/editor/motion_warnings.h"

#include <gtest/gtest.h>

namespace esim::studio {
namespace {

const SE3 kIdentity{Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};

/// A wall of 2 n x n triangles across x = 0, from -1 to 1 m, and a triangle at x = -2, far from the motion.
Scene wall(int n) {
  Mesh mesh;
  for (int z = 0; z <= n; ++z) {
    for (int y = 0; y <= n; ++y)
      mesh.vertices.emplace_back(0, 2.0F * static_cast<float>(y) / static_cast<float>(n) - 1,
                                 2.0F * static_cast<float>(z) / static_cast<float>(n) - 1);
  }
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh.triangles.push_back({a, b, c}); };
  const auto row = static_cast<std::uint32_t>(n + 1);
  for (std::uint32_t z = 0; z + 1 < row; ++z) {
    for (std::uint32_t y = 0; y + 1 < row; ++y) {
      const std::uint32_t a = z * row + y;
      add(a, a + 1, a + row + 1), add(a, a + row + 1, a + row);
    }
  }
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3f& far : {Eigen::Vector3f(-2, -3, -3), Eigen::Vector3f(-2, 3, -3), Eigen::Vector3f(2, 3, 3)})
    mesh.vertices.push_back(far);
  add(first, first + 1, first + 1);
  return still_scene(std::move(mesh));
}

/// Straight ahead along x, `count` samples a second long each, from -1 m to 1 m.
std::vector<MotionSample> course(int count, double y_m) {
  std::vector<MotionSample> samples;
  for (int i = 0; i < count; ++i) {
    Kinematics body;
    body.T_world_body.translation = {-1 + 2.0 * i / (count - 1), y_m, 0.01};
    samples.push_back({i * kNsPerSecond, body});
  }
  return samples;
}

TEST(MotionWarnings, TellWhereTheCameraGoesThroughASurface) {
  for (const int triangles : {1, 300}) {
    for (const int samples : {2, 16, 17, 18, 100}) {
      const std::vector<MotionSample> through = course(samples, 0.3037);
      const std::vector<MotionWarning> warnings = motion_warnings(through, kIdentity, wall(triangles));
      ASSERT_EQ(warnings.size(), 1U) << triangles << " " << samples;
      EXPECT_EQ(warnings[0].what, "the camera passes through a surface");
      const auto at = [&](TimeNs t) {
        return through[static_cast<std::size_t>(t / kNsPerSecond)].body.T_world_body.translation.x();
      };
      EXPECT_LE(at(warnings[0].from), 0);
      EXPECT_GE(at(warnings[0].to), 0);
      EXPECT_NEAR(at(warnings[0].to) - at(warnings[0].from), 2.0 / (samples - 1), 2.0 / (samples - 1) + 1e-9);
      EXPECT_TRUE(motion_warnings(course(samples, 1.2), kIdentity, wall(triangles)).empty()) << "past its edge";
    }
  }
}

TEST(MotionWarnings, AMotionOfOneSampleIsNone) {
  EXPECT_TRUE(motion_warnings(course(2, 0.3037), SE3{Eigen::Quaterniond::Identity(), {0, 1.5, 0}}, wall(2)).empty());
  EXPECT_TRUE(motion_warnings({course(2, 0.3037).front()}, kIdentity, wall(2)).empty());
  EXPECT_TRUE(motion_warnings({}, kIdentity, wall(2)).empty());
}

}  // namespace
}  // namespace esim::studio
