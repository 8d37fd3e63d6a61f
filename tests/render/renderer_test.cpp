// The contract of every renderer. To test a new one, add it to render/scenes.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esim/geometry/so3.h"
#include "esim/scene/images/texture.h"
#include "render/engines.h"
#include "render/every_renderer.h"

namespace esim {
namespace {

class EveryRenderer : public test::EveryRenderer {
 protected:
  std::unique_ptr<Renderer> make(const Workers& workers) const final {
    return test::make_any_renderer(name_, model_, workers);
  }

  const Kinematics camera_ = test::moving_camera();
  const std::vector<Kinematics> objects_ = test::objects_of(name_);
};

/// Renderers with a 3D scene.
class EveryRendererOfSpace : public EveryRenderer {};

TEST_P(EveryRendererOfSpace, MotionFieldIsTheVelocityOfTheImageOfWhatIsSeen) {
  const Sample sample = test::render(*renderer_, model_, camera_, objects_);
  const auto surfaces = test::deforming_surfaces_of(name_);
  ASSERT_EQ(renderer_->traits().deforms, surfaces != nullptr);
  ASSERT_EQ(sample.surface.empty(), surfaces == nullptr);
  // Where a pinhole image is looked up, depth is less precise.
  const bool looked_up = name_ == "deforming_gl" && std::get<1>(GetParam()) > 0;
  constexpr double kStep = 1e-3;
  double squared_error = 0, squared = 0;
  int count = 0;
  for (int y = 0; y < model_.height; ++y) {
    for (int x = 0; x < model_.width; ++x) {
      const Eigen::Vector3d bearing = model_.back_project(Eigen::Vector2d(x, y))->bearing;
      const double depth = std::isfinite(sample.depth(x, y)) ? double{sample.depth(x, y)} : 1e9;
      const Eigen::Vector3d point = camera_.T_world_body * (depth * bearing);
      const unsigned seen = sample.object.empty() ? 0 : sample.object(x, y);
      const auto image_of_it = [&](double dt) {
        Eigen::Vector3d moved = point;
        if (seen > 0) {
          Eigen::Vector3d in_object = objects_[seen - 1].T_world_body.inverse() * point;
          if (surfaces != nullptr) {
            Eigen::Vector3f now, then;
            surfaces->locate(seen, test::kTime, {&sample.surface(x, y), 1}, {&now, 1});
            surfaces->locate(seen, test::kTime + to_ns(dt), {&sample.surface(x, y), 1}, {&then, 1});
            const Eigen::Vector3d there = objects_[seen - 1].T_world_body * now.cast<double>();
            const auto pixel = model_.project(camera_.T_world_body.inverse() * there);
            if (looked_up) {
              EXPECT_LT((pixel->pixel - Eigen::Vector2d(x, y)).norm(), 0.1) << x << ", " << y;
            } else {
              EXPECT_LT((now.cast<double>() - in_object).norm(), 1e-4) << x << ", " << y;
            }
            in_object += (then - now).cast<double>();
          }
          moved = test::objects_of(name_, dt)[seen - 1].T_world_body * in_object;
        }
        return model_.project(test::moving_camera(dt).T_world_body.inverse() * moved);
      };
      const auto before = image_of_it(-kStep), after = image_of_it(kStep);
      ASSERT_TRUE(before && after);
      const Eigen::Vector2d expected = (after->pixel - before->pixel) / (2 * kStep);
      squared_error += (expected - Eigen::Vector2d(sample.motion_x(x, y), sample.motion_y(x, y))).squaredNorm();
      squared += expected.squaredNorm();
      ++count;
    }
  }
  const double rmse = std::sqrt(squared_error / count), rms = std::sqrt(squared / count);
  EXPECT_GT(rms, 50.0) << "the test's camera should move";
  EXPECT_LT(rmse / rms, 1e-3);
  EXPECT_LT(rmse, 0.05);
}

TEST_P(EveryRenderer, SeveralRenderingsMayBeUnderWay) {
  // With one renderer and with two, finished in a different order than started; one is never finished.
  const auto other = make(test::two_threads());
  const auto expect_that_of = [&](double dt, Rendering& rendering) {
    Sample sample, expected;
    rendering.finish(sample);
    renderer_->render(view(dt), expected);
    EXPECT_EQ(sample.t, expected.t);
    EXPECT_TRUE(std::ranges::equal(sample.irradiance.pixels(), expected.irradiance.pixels()));
    EXPECT_TRUE(std::ranges::equal(sample.depth.pixels(), expected.depth.pixels()));
    EXPECT_TRUE(std::ranges::equal(sample.motion_x.pixels(), expected.motion_x.pixels()));
    EXPECT_TRUE(std::ranges::equal(sample.object.pixels(), expected.object.pixels()));
  };
  const auto first = renderer_->start(view(0));
  const auto beside = other->start(view(0.1));
  auto unwanted = renderer_->start(view(0.2));
  const auto last = renderer_->start(view(0.3));
  expect_that_of(0.3, *last);
  unwanted.reset();
  expect_that_of(0.1, *beside);
  expect_that_of(0, *first);
}

TEST_P(EveryRenderer, EvaluatesTilesOfSeveralTimesTogether) {
  const Tile parts[] = {{0, 0, model_.width, 21}, {0, 21, 17, model_.height - 21}};
  std::vector<RenderRequest> requests;
  for (const Tile& part : parts) {
    const double dt = 0.05 * static_cast<double>(requests.size());
    requests.push_back(
        {test::kTime + to_ns(dt), test::moving_camera(dt), {part}, test::objects_of(name_, dt), false, 4});
  }
  Sample together;
  renderer_->start_together(requests)->finish(together);
  EXPECT_EQ(together.t, test::kTime);
  EXPECT_EQ(together.tiles, std::vector<Tile>({parts[0], parts[1]}));
  for (RenderRequest request : requests) {
    request.motion_rows = 1;
    Sample alone;
    renderer_->render(request, alone);
    const Tile part = request.tiles[0];
    for (int y = part.y; y < part.y + part.height; ++y) {
      for (int x = part.x; x < part.x + part.width; ++x) {
        ASSERT_EQ(together.irradiance(x, y), alone.irradiance(x, y)) << x << ", " << y;
        ASSERT_EQ(together.depth(x, y), alone.depth(x, y)) << x << ", " << y;
        if (y % 4 == 0) {
          ASSERT_EQ(together.motion_x(x, y), alone.motion_x(x, y)) << x << ", " << y;
        }
      }
    }
  }
}

TEST_P(EveryRenderer, BrightnessMovesWithTheMotionField) {
  if (name_.find("glossy") != std::string::npos) GTEST_SKIP() << "highlights move over surfaces";
  // Brightness constancy, Eq. 1: dE/dt + <grad E, V> = 0 on a smooth texture. Ties E, Z and V together.
  const Sample sample = test::render(*renderer_, model_, camera_, objects_);
  constexpr double kStep = 2e-3;
  const auto at = [&](double dt) {
    return test::render(*renderer_, model_, test::moving_camera(dt), test::objects_of(name_, dt), {}, dt);
  };
  const Sample before = at(-kStep), after = at(kStep);
  std::vector<double> errors;
  double squared = 0;
  for (int y = 1; y + 1 < model_.height; ++y) {
    for (int x = 1; x + 1 < model_.width; ++x) {
      const double gradient_x = (sample.irradiance(x + 1, y) - sample.irradiance(x - 1, y)) / 2.0;
      const double gradient_y = (sample.irradiance(x, y + 1) - sample.irradiance(x, y - 1)) / 2.0;
      const double expected = -(gradient_x * sample.motion_x(x, y) + gradient_y * sample.motion_y(x, y));
      const double measured = (after.irradiance(x, y) - before.irradiance(x, y)) / (2 * kStep);
      errors.push_back(std::fabs(measured - expected));
      squared += expected * expected;
    }
  }
  // The 90th percentile, since corners of a room and edges of boxes are not smooth. Edges of splats are wider.
  const std::size_t tenths = objects_.empty() ? 9 : name_.starts_with("moving_splats") ? 7 : 8;
  const auto rank = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() * tenths / 10);
  std::nth_element(errors.begin(), rank, errors.end());
  EXPECT_LT(*rank, 0.1 * std::sqrt(squared / static_cast<double>(errors.size())));
}

TEST_P(EveryRenderer, ATileIsTheSameAsInTheWholeFrame) {
  const Sample whole = test::render(*renderer_, model_, camera_, objects_);
  const std::vector<Tile> tiles = {{0, 0, 1, 1}, {17, 3, 35, 21}, {100, 77, 20, 13}};
  Sample sample = test::render(*renderer_, model_, camera_, objects_, tiles);
  EXPECT_EQ(sample.tiles, tiles);
  EXPECT_EQ(sample.t, 123);
  for (const Tile& tile : tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        ASSERT_EQ(sample.irradiance(x, y), whole.irradiance(x, y)) << x << ", " << y;
        ASSERT_EQ(sample.depth(x, y), whole.depth(x, y));
        ASSERT_EQ(sample.motion_x(x, y), whole.motion_x(x, y));
        ASSERT_EQ(sample.motion_y(x, y), whole.motion_y(x, y));
        ASSERT_TRUE(objects_.empty() || sample.object(x, y) == whole.object(x, y));
      }
    }
  }
  EXPECT_EQ(sample.irradiance(60, 60), 0.0F) << "a pixel outside the tiles was touched";
}

TEST_P(EveryRenderer, SaysWhichObjectEachPixelSeesWhereAsked) {
  const Sample plain = test::render(*renderer_, model_, camera_, objects_);
  EXPECT_EQ(plain.object.empty(), objects_.empty());
  RenderRequest request{test::kTime, camera_, {{0, 0, model_.width, model_.height}}, objects_, true};
  Sample whole, tile;
  renderer_->render(request, whole);
  EXPECT_TRUE(std::ranges::equal(whole.irradiance.pixels(), plain.irradiance.pixels()));
  EXPECT_TRUE(std::ranges::equal(whole.motion_x.pixels(), plain.motion_x.pixels()));
  request.tiles = {{17, 3, 35, 21}};
  renderer_->render(request, tile);

  // If a pinhole image is looked up, edges are off by half a pixel, and sometimes the slope of the surface is wrong.
  // Splats reach beyond corners, and a pixel beyond outlines.
  const bool of_engine = name_ == "moving_unrealcv", is_gl = name_ == "moving_gl" || name_ == "moving_glossy_gl";
  const double tolerance = of_engine || (is_gl && std::get<1>(GetParam()) > 0) ? 0.2
                           : name_.starts_with("moving_splats")                ? 0.06
                                                                               : 0.01;
  int astray = 0;
  std::vector<int> count(3);
  for (int y = 0; y < model_.height; ++y) {
    for (int x = 0; x < model_.width; ++x) {
      const int object = whole.object(x, y);
      ASSERT_LE(object, 2);
      ++count[static_cast<std::size_t>(object)];
      ASSERT_TRUE(x < 17 || x >= 52 || y < 3 || y >= 24 || tile.object(x, y) == object);
      if (objects_.empty() || name_.starts_with("deforming")) continue;
      // On the surface of that box of the test: the largest coordinate is 1, relative to half the box.
      const Eigen::Vector3d point =
          camera_.T_world_body * (double{whole.depth(x, y)} * model_.back_project(Eigen::Vector2d(x, y))->bearing);
      const auto in_box = [&](const Eigen::Vector3d& p, double scale) {
        return p.cwiseQuotient(scale * Eigen::Vector3d(4, 3, 2)).cwiseAbs().maxCoeff();
      };
      const double at[] = {in_box(point, 1), in_box(objects_[0].T_world_body.inverse() * point, 0.15),
                           in_box(objects_[1].T_world_body.inverse() * point, 0.2)};
      const bool is_on_it = std::fabs(at[object] - 1) <= tolerance;
      astray += !is_on_it;
      ASSERT_TRUE(is_on_it || of_engine) << x << ", " << y << ": " << at[object];
    }
  }
  EXPECT_LE(astray, model_.width * model_.height / 500);
  const bool has_objects = !objects_.empty() || name_.ends_with("sprites");
  EXPECT_EQ(std::min(count[1], count[2]) > 50, has_objects);
  EXPECT_EQ(count[0] == model_.width * model_.height, !has_objects);
}

TEST_P(EveryRenderer, DoesNotDependOnThreadsOrHistory) {
  const Workers one(1);
  const auto other = make(one);
  test::render(*renderer_, model_, test::moving_camera(0.3), test::objects_of(name_, 0.3));
  const Sample a = test::render(*renderer_, model_, camera_, objects_),
               b = test::render(*other, model_, camera_, objects_);
  EXPECT_TRUE(std::equal(a.irradiance.pixels().begin(), a.irradiance.pixels().end(), b.irradiance.pixels().begin()));
  EXPECT_TRUE(std::equal(a.motion_x.pixels().begin(), a.motion_x.pixels().end(), b.motion_x.pixels().begin()));
}

const auto kLenses = testing::Range(0, 4);

INSTANTIATE_TEST_SUITE_P(OfSpace, EveryRenderer, testing::Combine(testing::ValuesIn(test::kRenderersOfSpace), kLenses),
                         EveryRenderer::name);
// One lens: software takes seconds for each test, and gl_splats_test.cpp compares all lenses with the processor.
const auto kGlSplats = testing::Combine(testing::Values("moving_splats_gl"), testing::Values(3));
INSTANTIATE_TEST_SUITE_P(OpenGLSplats, EveryRenderer, kGlSplats, EveryRenderer::name);
INSTANTIATE_TEST_SUITE_P(OpenGLSplats, EveryRendererOfSpace, kGlSplats, EveryRenderer::name);
INSTANTIATE_TEST_SUITE_P(OnSensor, EveryRenderer,
                         testing::Combine(testing::ValuesIn(test::kRenderersOnSensor), kLenses), EveryRenderer::name);
INSTANTIATE_TEST_SUITE_P(Engines, EveryRenderer, testing::Combine(testing::ValuesIn(test::kEngines), kLenses),
                         EveryRenderer::name);
INSTANTIATE_TEST_SUITE_P(OfSpace, EveryRendererOfSpace,
                         testing::Combine(testing::ValuesIn(test::kRenderersOfSpace), kLenses), EveryRenderer::name);
INSTANTIATE_TEST_SUITE_P(Engines, EveryRendererOfSpace, testing::Combine(testing::ValuesIn(test::kEngines), kLenses),
                         EveryRenderer::name);

// --- closed forms ---------------------------------------------------------------------------------------------------

double smooth_value(double u, double v) {
  return 0.5 + 0.2 * std::sin(2 * std::numbers::pi * 3 * u) + 0.2 * std::cos(2 * std::numbers::pi * 2 * v);
}

TEST(PanoramaRenderer, ShowsEachDirectionWhereItIs) {
  for (int kind = 0; kind < 4; ++kind) {
    const Camera model = test::distorted_camera(kind);
    const Kinematics camera = test::moving_camera();
    const Sample sample = test::render(*test::make_renderer("panorama", model), model, camera);
    for (int y = 0; y < model.height; y += 7) {
      for (int x = 0; x < model.width; x += 7) {
        const Eigen::Vector3d d = camera.T_world_body.rotation * model.back_project(Eigen::Vector2d(x, y))->bearing;
        const double u = 0.5 - std::atan2(d.y(), d.x()) / (2 * std::numbers::pi);
        const double v = 0.5 - std::atan2(d.z(), std::hypot(d.x(), d.y())) / std::numbers::pi;
        EXPECT_NEAR(sample.irradiance(x, y), smooth_value(u, v), 2e-3) << x << ", " << y << ", distortion " << kind;
        EXPECT_TRUE(std::isinf(sample.depth(x, y)));
      }
    }
  }
}

TEST(PanoramaRenderer, WrapsAtTheBack) {
  // Looking along -x, across longitude ±180 degrees: no seam in a texture that is periodic.
  Kinematics camera;
  Eigen::Matrix3d R;
  R << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  camera.T_world_body.rotation = Eigen::Quaterniond(R);
  const Camera model = test::distorted_camera(0);
  const Sample sample = test::render(*test::make_renderer("panorama", model), model, camera);
  for (int x = 1; x < model.width; ++x) {
    EXPECT_LT(std::fabs(sample.irradiance(x, 40) - sample.irradiance(x - 1, 40)), 0.02F) << x;
  }
}

TEST(PanoramaRenderer, IsFiniteAtThePoles) {
  Kinematics camera;  // looks along world z: the zenith
  const Camera model = test::distorted_camera(0);
  const Sample sample = test::render(*test::make_renderer("panorama", model), model, camera);
  for (const float value : sample.irradiance.pixels()) EXPECT_TRUE(value > 0 && value < 1);
}

TEST(SpritesRenderer, SaysWhoseMotionEachPixelHas) {
  const Camera model = test::distorted_camera(0);
  const SpriteScene both = test::test_sprites();
  const auto render = [&](const SpriteScene& scene) {
    Sample sample;
    make_sprites_renderer(scene, model, test::two_threads())
        ->render({test::kTime, {}, {{0, 0, model.width, model.height}}, {}, true}, sample);
    return sample;
  };
  const Sample found = render(both);
  const Sample alone[] = {render({{both.sprites[0]}, 0.2F}), render({{both.sprites[1]}, 0.2F})};
  bool uncovered = false;
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      const Sample& sprite = alone[found.object(x, y) - 1];
      ASSERT_EQ(found.motion_x(x, y), sprite.motion_x(x, y)) << x << ", " << y;
      uncovered = uncovered || alone[0].object(x, y) == 0;
    }
  }
  EXPECT_TRUE(uncovered) << "0 outside the only sprite";
}

TEST(PlaneRenderer, ShowsEachPointWhereItIs) {
  const TexturedPlane plane = test::test_plane();
  for (int kind = 0; kind < 4; ++kind) {
    const Camera model = test::distorted_camera(kind);
    const Kinematics camera = test::moving_camera();
    const Sample sample = test::render(*test::make_renderer("plane", model), model, camera);
    for (int y = 0; y < model.height; y += 7) {
      for (int x = 0; x < model.width; x += 7) {
        const Eigen::Vector3d bearing = model.back_project(Eigen::Vector2d(x, y))->bearing;
        const SE3 T_plane_camera = plane.T_world_plane.inverse() * camera.T_world_body;
        const Eigen::Vector3d o = T_plane_camera.translation, d = T_plane_camera.rotation * bearing;
        const double depth = -o.z() / d.z();
        const Eigen::Vector3d point = o + depth * d;
        EXPECT_NEAR(sample.depth(x, y), depth, 1e-5 * depth);
        EXPECT_NEAR(sample.irradiance(x, y), smooth_value(point.x() / 5.0 + 0.5, point.y() / 2.5 + 0.5), 3e-3);
      }
    }
  }
}

TEST(PlaneRenderer, ShowsTheBackgroundBesideThePlaneAndBehindTheCamera) {
  TexturedPlane plane = test::test_plane();
  plane.endless = false;
  plane.width_m = 0.1;
  const Camera model = test::distorted_camera(0);
  const auto renderer = make_plane_renderer(plane, model, test::two_threads());
  Sample sample = test::render(*renderer, model, test::moving_camera());
  EXPECT_EQ(sample.irradiance(0, 0), 0.2F);
  EXPECT_TRUE(std::isinf(sample.depth(0, 0)));
  EXPECT_TRUE(std::isfinite(sample.motion_x(0, 0)));

  Kinematics away = test::moving_camera();
  away.T_world_body.rotation =
      away.T_world_body.rotation * Eigen::Quaterniond(0, 0, 1, 0);  // turned about y by 180 degrees
  sample = test::render(*renderer, model, away);
  for (const float value : sample.irradiance.pixels()) EXPECT_EQ(value, 0.2F);
}

}  // namespace
}  // namespace esim
