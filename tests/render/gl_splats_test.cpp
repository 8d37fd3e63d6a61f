// Splats by OpenGL against those by the processor.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "esim/backends/opengl/splats/gl_splat_renderer.h"
#include "esim/backends/splats/splat_renderer.h"
#include "esim/core/error.h"
#include "render/scenes.h"

namespace esim {
namespace {

class GlSplatsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  }
};

struct Cloud {
  int count = 800;
  int degree = 3;
  double size = 4;  // of the box around the camera, m
  float largest = 0.6F;
  SplatFilter filter = SplatFilter::dilated;
  SplatLight light = SplatLight::display;
};

/// Random splats in front of, behind and around the moving camera.
std::shared_ptr<const Splats> random_splats(const Cloud& cloud, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> even(-1, 1);
  std::normal_distribution<float> normal;
  Splats splats;
  splats.degree = cloud.degree;
  splats.filter = cloud.filter;
  splats.light = cloud.light;
  splats.to_object = Eigen::Quaterniond(0.8, 0.1, -0.5, 0.2).normalized();
  const auto size = static_cast<float>(cloud.size);
  for (int i = 0; i < cloud.count; ++i) {
    splats.positions.emplace_back(size * even(random), size * even(random), size * even(random));
    const auto deviation = [&] { return cloud.largest * std::exp(1.5F * (even(random) - 1)); };
    splats.deviations.emplace_back(deviation(), deviation(), deviation());
    splats.rotations.push_back(
        Eigen::Vector4f(normal(random), normal(random), normal(random), normal(random)).normalized());
    splats.opacities.push_back(0.5F + 0.5F * even(random));
    for (std::size_t k = 0; k < splats.coefficients() * 3; ++k)
      splats.harmonics.push_back((k < 3 ? 1.0F : 0.2F) * normal(random));
  }
  return std::make_shared<const Splats>(std::move(splats));
}

RenderRequest request_of(const Camera& model, std::vector<Kinematics> objects = {}) {
  return {test::kTime, test::moving_camera(), {{0, 0, model.width, model.height}}, std::move(objects), true};
}

Sample render(Renderer& renderer, const RenderRequest& request) {
  Sample sample;
  renderer.render(request, sample);
  return sample;
}

/// Compares with the processor's renderer.
void expect_agreement(const std::vector<SplatObject>& objects, const SplatOptions& options, const Camera& model,
                      const RenderRequest& request, double footprint = 1) {
  const auto processor =
      make_splat_renderer(build_splat_scene(objects), options, model, test::two_threads(), {}, footprint);
  const auto gl = make_gl_splat_renderer(objects, options, model, {}, footprint);
  const Sample expected = render(*processor, request), sample = render(*gl, request);
  double light = 0, mean = 0, motion = 0;
  int other_depths = 0, other_objects = 0, seen = 0;
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      light = std::max(light, std::fabs(double{expected.irradiance(x, y)} - sample.irradiance(x, y)));
      mean += expected.irradiance(x, y);
      if (expected.object(x, y) != sample.object(x, y)) ++other_objects;
      if (std::isinf(expected.depth(x, y)) && std::isinf(sample.depth(x, y))) continue;
      ++seen;
      if (!(std::fabs(1 - double{sample.depth(x, y)} / expected.depth(x, y)) < 1e-3)) {
        ++other_depths;
      } else {
        const double speed = std::hypot(expected.motion_x(x, y), expected.motion_y(x, y));
        const double off = std::hypot(expected.motion_x(x, y) - sample.motion_x(x, y),
                                      expected.motion_y(x, y) - sample.motion_y(x, y));
        if (expected.object(x, y) == sample.object(x, y)) motion = std::max(motion, off / (1 + speed));
      }
    }
  }
  const int pixels = model.width * model.height;
  EXPECT_LT(light, 1e-3);
  EXPECT_LE(other_depths, pixels / 2000);
  EXPECT_LE(other_objects, pixels / 2000);
  EXPECT_LT(motion, 2e-3);
  EXPECT_GT(seen, pixels / 4) << "too little is compared";
  EXPECT_GT(mean / pixels, 0.03);
}

TEST_F(GlSplatsTest, AgreeForEveryDegreeAndFilter) {
  const Camera model = test::distorted_camera(0);
  for (int degree = 0; degree <= 3; ++degree) {
    for (const SplatFilter filter : {SplatFilter::dilated, SplatFilter::antialiased, SplatFilter::mip}) {
      SCOPED_TRACE(testing::Message() << "degree " << degree << ", filter " << static_cast<int>(filter));
      const SplatObject object{random_splats({.degree = degree, .filter = filter}, 1)};
      expect_agreement({object}, {}, model, request_of(model));
    }
  }
}

TEST_F(GlSplatsTest, AgreeThroughEveryLensAndProjection) {
  for (int kind = 0; kind < 4; ++kind) {
    const Camera model = test::distorted_camera(kind);
    for (const auto projection : {SplatProjection::automatic, SplatProjection::linear, SplatProjection::unscented}) {
      SCOPED_TRACE(testing::Message() << "lens " << kind << ", projection " << static_cast<int>(projection));
      SplatOptions options;
      options.projection = projection;
      expect_agreement({{random_splats({}, 2)}}, options, model, request_of(model));
    }
  }
}

TEST_F(GlSplatsTest, AgreeInBothOrdersOnLightAndBackground) {
  const Camera model = test::distorted_camera(2);
  SplatOptions options;
  options.order = SplatOrder::depth;
  options.background = 0.4F;
  options.gain = 1.7F;
  expect_agreement({{random_splats({}, 3)}}, options, model, request_of(model));
  options.display_gamma = 2.2;
  expect_agreement({{random_splats({}, 3)}}, options, model, request_of(model));
  expect_agreement({{random_splats({.light = SplatLight::linear}, 3)}}, options, model, request_of(model));
}

TEST_F(GlSplatsTest, AgreeForOtherFootprints) {
  const Camera model = test::distorted_camera(1);
  expect_agreement({{random_splats({.filter = SplatFilter::antialiased}, 4)}}, {}, model, request_of(model), 2);
}

TEST_F(GlSplatsTest, AgreeOnMovingObjects) {
  const Cloud small{.count = 200, .degree = 2, .size = 0.5, .largest = 0.2F, .filter = SplatFilter::mip};
  const std::vector<SplatObject> objects = {
      {random_splats({.degree = 1}, 5)}, {random_splats(small, 6), 1}, {random_splats(small, 7), 0}};
  for (int kind = 0; kind < 4; ++kind) {
    SCOPED_TRACE(kind);
    const Camera model = test::distorted_camera(kind);
    expect_agreement(objects, {}, model, request_of(model, test::moving_objects(0)));
  }
}

TEST_F(GlSplatsTest, AgreeNextToTheCamera) {
  const Camera model = test::distorted_camera(0);
  const Cloud dense{.count = 3000, .degree = 0, .size = 0.4, .largest = 0.2F};
  for (const auto projection : {SplatProjection::linear, SplatProjection::unscented}) {
    SplatOptions options;
    options.projection = projection;
    expect_agreement({{random_splats(dense, 8)}}, options, model, request_of(model));
  }
}

/// More splats in bins than the renderer first has room for: it must notice this in each image that is in progress.
TEST_F(GlSplatsTest, KeepAllSplatsOfLargeImages) {
  const Camera model = Camera::from_fov(640, 400, 1.2);
  const Cloud large{.count = 600, .degree = 0, .size = 3, .largest = 2.0F};
  const std::vector<SplatObject> objects = {{random_splats(large, 9)}};
  const auto gl = make_gl_splat_renderer(objects, {}, model, {});
  const auto first = gl->start(request_of(model)), second = gl->start(request_of(model));
  Sample one, other;
  first->finish(one);
  second->finish(other);
  EXPECT_TRUE(std::ranges::equal(one.irradiance.pixels(), other.irradiance.pixels()));
  expect_agreement(objects, {}, model, request_of(model));
}

TEST_F(GlSplatsTest, AreTheSameEveryTime) {
  const Camera model = test::distorted_camera(1);
  const std::vector<SplatObject> objects = {{random_splats({.count = 4000}, 10)}};
  const auto gl = make_gl_splat_renderer(objects, {}, model, {});
  const Sample first = render(*gl, request_of(model));
  RenderRequest later = request_of(model);
  later.camera = test::moving_camera(0.3);
  const auto in_between = gl->start(later);
  const auto again = gl->start(request_of(model));
  Sample other, second;
  again->finish(second);
  in_between->finish(other);
  EXPECT_TRUE(std::ranges::equal(first.irradiance.pixels(), second.irradiance.pixels()));
  EXPECT_TRUE(std::ranges::equal(first.depth.pixels(), second.depth.pixels()));
  EXPECT_FALSE(std::ranges::equal(first.irradiance.pixels(), other.irradiance.pixels()));
  const Sample elsewhere = render(*make_gl_splat_renderer(objects, {}, model, {}), request_of(model));
  EXPECT_TRUE(std::ranges::equal(first.irradiance.pixels(), elsewhere.irradiance.pixels()));
}

TEST_F(GlSplatsTest, TilesEqualTheFrame) {
  const Camera model = test::distorted_camera(0);
  const auto gl = make_gl_splat_renderer({{random_splats({}, 11)}}, {}, model, {});
  const Sample frame = render(*gl, request_of(model));
  RenderRequest request = request_of(model);
  request.tiles = {{3, 5, 20, 11}, {70, 40, 17, 30}};
  const Sample tiles = render(*gl, request);
  for (const Tile& tile : request.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        EXPECT_EQ(tiles.irradiance(x, y), frame.irradiance(x, y));
        EXPECT_EQ(tiles.depth(x, y), frame.depth(x, y));
        EXPECT_EQ(tiles.motion_x(x, y), frame.motion_x(x, y));
      }
    }
  }
}

TEST_F(GlSplatsTest, ShowTheBackgroundWithoutSplats) {
  const Camera model = test::distorted_camera(0);
  SplatOptions options;
  options.background = 0.3F;
  const auto empty = std::make_shared<const Splats>();
  for (const auto& objects : {std::vector<SplatObject>{}, std::vector<SplatObject>{{empty}}}) {
    const Sample sample = render(*make_gl_splat_renderer(objects, options, model, {}), request_of(model));
    for (const float light : sample.irradiance.pixels()) ASSERT_NEAR(light, 0.3F, 1e-5F);
    for (const float depth : sample.depth.pixels()) ASSERT_TRUE(std::isinf(depth));
  }
}

TEST_F(GlSplatsTest, SayWhatIsMissing) {
  const Camera model = test::distorted_camera(0);
  EXPECT_THROW(make_gl_splat_renderer({{random_splats({}, 12)}}, {}, model, 31), UserError);
  SplatOptions by_ray;
  by_ray.order = SplatOrder::ray;
  EXPECT_THROW(make_gl_splat_renderer({{random_splats({}, 12)}}, by_ray, model, {}), UserError);
  const auto gl = make_gl_splat_renderer({{random_splats({}, 12)}}, {}, model, {});
  EXPECT_NE(gl->traits().label().find("OpenGL"), std::string::npos);
  EXPECT_EQ(gl->traits().granularity, Granularity::frame);
}

}  // namespace
}  // namespace esim
