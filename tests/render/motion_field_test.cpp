// The closed form of the motion field against the true motion of points, for the static scene and moving objects.
#include "esim/render/motion_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "esim/geometry/so3.h"
#include "esim/render/bands.h"
#include "render/scenes.h"

namespace esim {
namespace {

/// The pose `dt` seconds later under a constant twist.
SE3 later(const Kinematics& body, double dt) {
  return {body.T_world_body.rotation * so3_exp(body.omega_body * dt),
          body.T_world_body.translation + body.velocity_world * dt};
}

Kinematics random_motion(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto vector = [&](double scale) {
    return Eigen::Vector3d(scale * normal(random), scale * normal(random), scale * normal(random));
  };
  Kinematics motion;
  motion.T_world_body = {so3_exp(vector(1)), vector(2)};
  motion.velocity_world = vector(1.5);
  motion.omega_body = vector(4);
  return motion;
}

class MotionField : public testing::TestWithParam<int> {};

TEST_P(MotionField, IsTheVelocityOfTheImageOfAPointOfWhateverIsSeen) {
  const Camera model = test::distorted_camera(GetParam());
  const PixelRays rays(model);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> depth_m(0.3, 20);

  RenderRequest request{0, test::moving_camera(), {{0, 0, model.width, model.height}}, {}};
  for (int i = 0; i < 3; ++i) request.objects.push_back(random_motion(random));
  Sample sample;
  prepare({&request, 1}, model.width, model.height, sample);
  for (float& z : sample.depth.pixels()) z = static_cast<float>(depth_m(random));
  for (std::uint16_t& seen : sample.object.pixels()) seen = static_cast<std::uint16_t>(random() % 4);
  motion_field(rays, relative_twists(request), request.tiles[0], sample);

  constexpr double kStep = 1e-4;
  double max_dynamic = 0;
  for (int y = 0; y < model.height; y += 3) {
    for (int x = 0; x < model.width; ++x) {
      const Eigen::Vector3d bearing = model.back_project(Eigen::Vector2d(x, y))->bearing;
      const Eigen::Vector3d point = request.camera.T_world_body * (double{sample.depth(x, y)} * bearing);
      const unsigned seen = sample.object(x, y);
      const auto image_of_it = [&](double dt) {
        const Eigen::Vector3d moved = seen == 0 ? point
                                                : later(request.objects[seen - 1], dt) *
                                                      (request.objects[seen - 1].T_world_body.inverse() * point);
        return model.project(later(request.camera, dt).inverse() * moved)->pixel;
      };
      const Eigen::Vector2d expected = (image_of_it(kStep) - image_of_it(-kStep)) / (2 * kStep);
      const Eigen::Vector2d actual(sample.motion_x(x, y), sample.motion_y(x, y));
      ASSERT_LT((actual - expected).norm(), 0.02 + 2e-4 * expected.norm()) << x << ", " << y << ", object " << seen;
      if (seen != 0) max_dynamic = std::max(max_dynamic, expected.norm());
    }
  }
  EXPECT_GT(max_dynamic, 300) << "the test's objects should move";
}

INSTANTIATE_TEST_SUITE_P(Distortions, MotionField, testing::Range(0, 4));

TEST(MotionField, VanishesOnWhatMovesWithTheCamera) {
  const Camera model = test::distorted_camera(1);
  const Kinematics camera = test::moving_camera();
  // Rigidly attached in front of the camera.
  const Kinematics companion = rigidly_attached(camera, {so3_exp(Eigen::Vector3d(0.3, 2, -1)), {0.2, -0.1, 1.5}});
  RenderRequest request{0, camera, {{0, 0, model.width, model.height}}, {companion}};
  Sample sample;
  prepare({&request, 1}, model.width, model.height, sample);
  sample.depth.fill(1.5F);
  sample.object.fill(1);
  motion_field(PixelRays(model), relative_twists(request), request.tiles[0], sample);
  for (const float v : sample.motion_x.pixels()) ASSERT_NEAR(v, 0, 1e-4);
  for (const float v : sample.motion_y.pixels()) ASSERT_NEAR(v, 0, 1e-4);
}

TEST(MotionField, IsTheSameWhetherOrNotThereAreObjectsOutOfSight) {
  const Camera model = test::distorted_camera(0);
  RenderRequest request{0, test::moving_camera(), {{0, 0, model.width, model.height}}, {}};
  Sample without, with;
  for (Sample* sample : {&without, &with}) {
    prepare({&request, 1}, model.width, model.height, *sample);
    sample->depth.fill(2.0F);
    motion_field(PixelRays(model), relative_twists(request), request.tiles[0], *sample);
    request.objects.resize(2);
  }
  EXPECT_TRUE(std::equal(with.motion_x.pixels().begin(), with.motion_x.pixels().end(),
                         without.motion_x.pixels().begin(), [](float a, float b) { return std::fabs(a - b) < 1e-3F; }));
  EXPECT_TRUE(without.object.empty());
  EXPECT_EQ(with.object.size(), with.depth.size());
}

}  // namespace
}  // namespace esim
