#include "esim/truth/optical_flow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "render/every_renderer.h"

namespace esim {
namespace {

/// Value between the pixels; NaN outside the area of their centres.
float bilinear(const Image<float>& image, double u, double v) {
  const int x = static_cast<int>(std::floor(u)), y = static_cast<int>(std::floor(v));
  if (x < 0 || y < 0 || x + 1 >= image.width() || y + 1 >= image.height())
    return std::numeric_limits<float>::quiet_NaN();
  const auto f = static_cast<float>(u - x), g = static_cast<float>(v - y);
  return (1 - g) * ((1 - f) * image(x, y) + f * image(x + 1, y)) +
         g * ((1 - f) * image(x, y + 1) + f * image(x + 1, y + 1));
}

/// Whether the 4 x 4 pixels around a point see the same object with smooth depth.
bool is_smooth_around(const Sample& sample, double u, double v) {
  const int left = static_cast<int>(std::floor(u)) - 1, top = static_cast<int>(std::floor(v)) - 1;
  if (left < 0 || top < 0 || left + 4 > sample.depth.width() || top + 4 > sample.depth.height()) return false;
  for (int y = top; y < top + 4; ++y) {
    for (int x = left; x < left + 4; ++x) {
      if (!sample.object.empty() && sample.object(x, y) != sample.object(left, top)) return false;
      if (x < left + 2 && std::isfinite(sample.depth(x, y))) {  // a crease or an edge bends 1 / Z
        const float a = 1 / sample.depth(x, y), b = 1 / sample.depth(x + 1, y), c = 1 / sample.depth(x + 2, y);
        if (std::fabs(a - 2 * b + c) > 0.002F * b) return false;
      }
      if (y < top + 2 && std::isfinite(sample.depth(x, y))) {
        const float a = 1 / sample.depth(x, y), b = 1 / sample.depth(x, y + 1), c = 1 / sample.depth(x, y + 2);
        if (std::fabs(a - 2 * b + c) > 0.002F * b) return false;
      }
    }
  }
  return true;
}

class EveryRendererOfSpace : public test::EveryRenderer {
 protected:
  Sample render(double dt) const {
    Sample sample;
    renderer_->render(view(dt), sample);
    return sample;
  }

  /// From now to `dt` seconds later.
  OpticalFlowImages optical_flow(double dt) const {
    OpticalFlowFromDepth field(model_, test::deforming_surfaces_of(name_), test::two_threads());
    EXPECT_EQ(field.advance(view(0), render(0)), nullptr);
    return *field.advance(view(dt), render(dt));
  }
};

TEST_P(EveryRendererOfSpace, OpticalFlowIsTheIntegralOfTheMotionFieldAlongThePath) {
  if (name_.starts_with("moving_splats")) GTEST_SKIP() << "splats that are as small as pixels have rough depth";
  constexpr int kSteps = 4;
  constexpr double kInterval = 0.04, kStep = kInterval / kSteps;
  std::vector<Sample> samples;
  for (int i = 0; i <= 2 * kSteps; ++i) samples.push_back(render(0.5 * kStep * i));
  const OpticalFlowImages found = optical_flow(kInterval);
  EXPECT_EQ(found.t0, test::kTime);
  EXPECT_EQ(found.t1, test::kTime + to_ns(kInterval));

  int compared = 0;
  double longest = 0, worst = 0;
  for (int y = 0; y < model_.height; ++y) {
    for (int x = 0; x < model_.width; ++x) {
      // Fourth-order Runge-Kutta method; stops if the path leaves the smooth area.
      Eigen::Vector2d at(x, y);
      const auto velocity = [&](int half_steps, const Eigen::Vector2d& p) -> Eigen::Vector2d {
        const Sample& sample = samples[static_cast<std::size_t>(half_steps)];
        const bool smooth = p.allFinite() && is_smooth_around(sample, p.x(), p.y()) &&
                            (sample.object.empty() || sample.object(static_cast<int>(p.x()), static_cast<int>(p.y())) ==
                                                          samples[0].object(x, y));
        if (!smooth) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
        return {bilinear(sample.motion_x, p.x(), p.y()), bilinear(sample.motion_y, p.x(), p.y())};
      };
      for (int i = 0; i < 2 * kSteps && at.allFinite(); i += 2) {
        const Eigen::Vector2d k1 = velocity(i, at), k2 = velocity(i + 1, at + 0.5 * kStep * k1),
                              k3 = velocity(i + 1, at + 0.5 * kStep * k2), k4 = velocity(i + 2, at + kStep * k3);
        at += kStep / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
      if (!at.allFinite()) continue;
      const Eigen::Vector2d moved = at - Eigen::Vector2d(x, y);
      longest = std::max(longest, moved.norm());
      worst = std::max(worst, (moved - Eigen::Vector2d(found.x(x, y), found.y(x, y))).norm());
      EXPECT_EQ(found.visible(x, y), 1) << x << ", " << y;
      ++compared;
    }
  }
  EXPECT_GT(longest, 3.0) << "the test's camera should move";
  EXPECT_GT(compared, model_.width * model_.height / (name_ == "splats" ? 4 : 3));
  EXPECT_LT(worst, 5e-3);
}

TEST_P(EveryRendererOfSpace, DepthPosesAndCalibrationMapOneImageOntoAnother) {
  if (name_.starts_with("moving_glossy")) GTEST_SKIP() << "highlights move over surfaces";
  if (name_.starts_with("moving_splats")) GTEST_SKIP() << "splats that are as small as pixels have rough depth";
  const OpticalFlowImages found = optical_flow(0.05);
  const Sample here = render(0), there = render(0.05);
  double squared_error = 0, squared_change = 0;
  int count = 0;
  for (int y = 0; y < model_.height; ++y) {
    for (int x = 0; x < model_.width; ++x) {
      // Next to an edge or a crease, values between pixels do not belong to either side.
      const double u = x + double{found.x(x, y)}, v = y + double{found.y(x, y)};
      if (found.visible(x, y) == 0 || !is_smooth_around(there, u, v)) continue;
      const float expected = bilinear(there.irradiance, u, v);
      squared_error += std::pow(expected - here.irradiance(x, y), 2);
      squared_change += std::pow(there.irradiance(x, y) - here.irradiance(x, y), 2);
      ++count;
    }
  }
  EXPECT_GT(count, model_.width * model_.height / (name_ == "splats" ? 3 : 2));
  EXPECT_GT(std::sqrt(squared_change / count), 0.02) << "the test's camera should move";
  EXPECT_LT(std::sqrt(squared_error / count), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Renderers, EveryRendererOfSpace,
                         testing::Combine(testing::ValuesIn(test::kRenderersOfSpace), testing::Values(0, 1, 2, 3)),
                         EveryRendererOfSpace::name);

// --- two planes: everything in closed form --------------------------------------------------------------------------

constexpr double kWall = 4, kCard = 2;  // m in front of the camera, along its z axis

/// A square in the plane z = 0 of its own frame.
Mesh square(float side) {
  const float h = side / 2;
  Mesh mesh;
  mesh.materials.push_back({"grey", nullptr, 0.5F});
  mesh.vertices = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.texture_uv.resize(2, {Eigen::Vector2f(0, 0), Eigen::Vector2f(0, 0), Eigen::Vector2f(0, 0)});
  mesh.material = {0, 0};
  return mesh;
}

/// A wall, and a card at half its distance, which may move.
class WallAndCard : public testing::TestWithParam<int> {
 protected:
  WallAndCard() {
    Scene scene = still_scene(square(40));
    for (Eigen::Vector3f& vertex : scene.objects[0].mesh.vertices) vertex.z() = kWall;
    scene.objects.push_back({"card", square(2 * kHalf), true});
    renderer_ = make_raycast_renderer(build_raycast_scene(scene), {}, model_, test::two_threads());
  }

  RenderRequest view(TimeNs t, const Eigen::Vector3d& camera, const Eigen::Vector3d& card) const {
    RenderRequest request{t, {}, {{0, 0, model_.width, model_.height}}, std::vector<Kinematics>(1)};
    request.camera.T_world_body.translation = camera;
    request.objects[0].T_world_body.translation = card;
    return request;
  }

  OpticalFlowImages optical_flow(const RenderRequest& from, const RenderRequest& to) const {
    OpticalFlowFromDepth field(model_, nullptr, test::two_threads());
    Sample sample;
    renderer_->render(from, sample);
    field.advance(from, sample);
    renderer_->render(to, sample);
    return *field.advance(to, sample);
  }

  /// The world point that a point of the image sees, and whether it is on the card.
  std::pair<Eigen::Vector3d, bool> seen(const RenderRequest& view, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d from = view.camera.T_world_body.translation;
    const Eigen::Vector3d bearing = model_.back_project(pixel)->bearing;
    const Eigen::Vector3d card = view.objects[0].T_world_body.translation;
    const Eigen::Vector3d on_card = from + (card.z() - from.z()) * bearing;
    if ((on_card - card).head<2>().cwiseAbs().maxCoeff() <= kHalf) return {on_card, true};
    return {from + (kWall - from.z()) * bearing, false};
  }

  /// Compares all pixels with rays, and returns the number of hidden pixels.
  int check(const RenderRequest& from, const RenderRequest& to) const {
    const OpticalFlowImages found = optical_flow(from, to);
    const Eigen::Vector3d card_moves =
        to.objects[0].T_world_body.translation - from.objects[0].T_world_body.translation;
    int hidden = 0;
    for (int y = 0; y < model_.height; ++y) {
      for (int x = 0; x < model_.width; ++x) {
        auto [point, on_card] = seen(from, Eigen::Vector2d(x, y));
        if (on_card) point += card_moves;
        const Eigen::Vector2d image = model_.project(to.camera.T_world_body.inverse() * point)->pixel;
        EXPECT_LT((image - Eigen::Vector2d(x + double{found.x(x, y)}, y + double{found.y(x, y)})).norm(), 1e-3)
            << x << ", " << y;
        const bool inside =
            image.x() >= -0.5 && image.y() >= -0.5 && image.x() < model_.width - 0.5 && image.y() < model_.height - 0.5;
        if (!inside) {
          EXPECT_EQ(found.visible(x, y), 0);
          continue;
        }
        // For a pixel at an edge, both results are valid.
        bool hit = false, missed = false;
        for (const double dx : {-0.5, 0.0, 0.5}) {
          for (const double dy : {-0.5, 0.0, 0.5})
            (seen(to, image + Eigen::Vector2d(dx, dy)).second ? hit : missed) = true;
        }
        if (hit && missed) continue;
        EXPECT_EQ(found.visible(x, y), on_card || missed) << x << ", " << y;
        hidden += found.visible(x, y) == 0;
      }
    }
    return hidden;
  }

  static constexpr float kHalf = 0.3F;
  const Camera model_ = test::distorted_camera(GetParam());
  std::unique_ptr<Renderer> renderer_;
};

TEST_P(WallAndCard, TheCardHidesTheWallWhereTheCameraMoves) {
  const Eigen::Vector3d card(0, 0, kCard);
  // It moves relative to the wall by about 100 px/m (1/2 - 1/4 1/m) 0.6 m = 15 px.
  EXPECT_GT(check(view(0, {-0.3, 0, 0}, card), view(1, {0.3, 0, 0}, card)), 200);
  EXPECT_GT(check(view(0, {0, 0, 0}, card), view(1, {0.1, -0.2, 1.2}, card)), 200);
}

TEST_P(WallAndCard, TheCardMovesAndHidesTheWall) {
  const Eigen::Vector3d camera(0, 0, 0);
  const RenderRequest from = view(0, camera, {-0.2, 0, kCard}), to = view(1, camera, {0.2, 0.1, kCard - 0.3});
  EXPECT_GT(check(from, to), 200);

  const OpticalFlowImages found = optical_flow(from, to);
  EXPECT_NEAR(found.x(5, 5), 0, 1e-4) << "the wall does not move";
  if (GetParam() == 0) {
    const double bearing = (60 - model_.cx) / model_.fx;  // on the card
    EXPECT_NEAR(found.x(60, 44), model_.fx * ((2 * bearing + 0.4) / 1.7 - bearing), 1e-3);
  }
}

TEST_P(WallAndCard, AStandingViewIsSeenAgain) {
  const RenderRequest from = view(0, {0.1, 0.2, 0.3}, {0, 0, kCard});
  const OpticalFlowImages found = optical_flow(from, from);
  for (const std::uint8_t visible : found.visible.pixels()) EXPECT_EQ(visible, 1);
  for (const float x : found.x.pixels()) EXPECT_NEAR(x, 0, 1e-4);
}

TEST_P(WallAndCard, WhatComesToLieBehindTheCameraHasNoImage) {
  const RenderRequest from = view(0, {0, 0, 0}, {0, 0, kCard}), to = view(1, {0, 0, 3}, {0, 0, kCard});
  const OpticalFlowImages found = optical_flow(from, to);
  EXPECT_TRUE(std::isnan(found.x(61, 44)));
  EXPECT_EQ(found.visible(61, 44), 0);
}

INSTANTIATE_TEST_SUITE_P(Lenses, WallAndCard, testing::Values(0, 1, 2, 3));

}  // namespace
}  // namespace esim
