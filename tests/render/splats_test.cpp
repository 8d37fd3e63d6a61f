#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "esim/backends/splats/splat_renderer.h"
#include "render/scenes.h"
#include "render/splat_reference.h"

namespace esim {
namespace {

using test::render_slowly;
using test::SplatPixel;
using test::SplatRules;

/// Splats around a point 2 m in front of the origin along z; many overlap, and some are needles or discs.
Splats random_splats(std::size_t count, int degree, SplatFilter filter, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform;
  Splats splats;
  splats.degree = degree;
  splats.filter = filter;
  splats.light = SplatLight::linear;
  for (std::size_t i = 0; i < count; ++i) {
    splats.positions.emplace_back(0.5F * normal(random), 0.4F * normal(random), 2 + 0.3F * normal(random));
    const auto size = [&] { return 0.03F * std::exp(normal(random)); };
    splats.deviations.emplace_back(size(), size(), i % 4 == 0 ? 0.0F : size());
    splats.rotations.emplace_back(
        Eigen::Vector4f(normal(random), normal(random), normal(random), normal(random)).normalized());
    splats.opacities.push_back(uniform(random));
    for (std::size_t k = 0; k < splats.coefficients() * 3; ++k)
      splats.harmonics.push_back((k < 3 ? 0.8F : 0.2F) * normal(random));
  }
  return splats;
}

Splats one_splat(const Eigen::Vector3f& position, const Eigen::Vector3f& deviations, float opacity, float light) {
  Splats splats;
  splats.light = SplatLight::linear;
  splats.positions = {position};
  splats.deviations = {deviations};
  splats.rotations = {Eigen::Vector4f::UnitW()};
  splats.opacities = {opacity};
  splats.harmonics.assign(3, (light - 0.5F) / 0.28209479F);
  return splats;
}

Kinematics at_origin() { return {}; }

const Camera kPinhole{96, 72, 90.3, 89.1, 46.2, 37.4, NoDistortion{}};

std::shared_ptr<const SplatScene> scene_of(const Splats& splats) {
  return build_splat_scene({{std::make_shared<const Splats>(splats)}});
}

Sample render(const Splats& splats, const SplatOptions& options = {}, const Camera& camera = kPinhole,
              const Kinematics& pose = at_origin()) {
  const auto renderer = make_splat_renderer(scene_of(splats), options, camera, test::two_threads());
  return test::render(*renderer, camera, pose);
}

double luminance_of(const SplatPixel& pixel) {
  return 0.2126 * pixel.colour[0] + 0.7152 * pixel.colour[1] + 0.0722 * pixel.colour[2];
}

SplatRules::Order order_in_reference(SplatOrder order) {
  if (order == SplatOrder::ray) return SplatRules::Order::ray;
  return order == SplatOrder::depth ? SplatRules::Order::depth : SplatRules::Order::distance;
}

/// Largest difference between two images of irradiance.
double largest_difference(const Sample& sample, const Image<SplatPixel>& expected) {
  double largest = 0;
  for (int y = 0; y < sample.irradiance.height(); ++y) {
    for (int x = 0; x < sample.irradiance.width(); ++x)
      largest = std::max(largest, std::abs(double{sample.irradiance(x, y)} - luminance_of(expected(x, y))));
  }
  return largest;
}

/// The number of pixels whose irradiances differ by more than `tolerance`.
int different_pixels(const Sample& sample, const Image<SplatPixel>& expected, double tolerance) {
  int count = 0;
  for (int y = 0; y < sample.irradiance.height(); ++y) {
    for (int x = 0; x < sample.irradiance.width(); ++x)
      count += !(std::abs(double{sample.irradiance(x, y)} - luminance_of(expected(x, y))) <= tolerance);
  }
  return count;
}

double psnr(const Image<float>& a, const Image<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(double{a.pixels()[i]} - double{b.pixels()[i]}, 2);
  return -10 * std::log10(sum / static_cast<double>(a.size()));
}

class SplatsOfEachKind : public testing::TestWithParam<std::tuple<int, SplatFilter>> {};

TEST_P(SplatsOfEachKind, EqualThePublishedEquations) {
  const auto [degree, filter] = GetParam();
  const Splats splats = random_splats(600, degree, filter, 1);
  for (const SplatOrder order : {SplatOrder::distance, SplatOrder::depth, SplatOrder::ray}) {
    SplatOptions options;
    options.order = order;
    const Sample sample = render(splats, options);
    const SplatRules rules{order_in_reference(order)};
    const Image<SplatPixel> expected = render_slowly(splats, kPinhole, {}, rules);
    if (order == SplatOrder::ray) {  // where two splats are equally near, up to rounding, either may be in front
      EXPECT_LE(different_pixels(sample, expected, 2e-4), kPinhole.width * kPinhole.height / 1000);
    } else {
      EXPECT_LT(largest_difference(sample, expected), 2e-4);
    }
    int seen = 0, differ = 0;
    for (int y = 0; y < kPinhole.height; ++y) {
      for (int x = 0; x < kPinhole.width; ++x) {
        const double depth = expected(x, y).depth;
        seen += std::isfinite(depth);
        differ += std::isfinite(depth) ? !(std::abs(double{sample.depth(x, y)} / depth - 1) < 1e-3)
                                       : std::isfinite(sample.depth(x, y));
      }
    }
    EXPECT_GT(seen, kPinhole.width * kPinhole.height / 5);
    EXPECT_LE(differ, seen / 500);  // where the transmittance is 0.5, up to rounding, between two splats
  }
}

TEST_P(SplatsOfEachKind, FadeInsteadOfEndingAtALeastOpacity) {
  // The published rule ends splats at 1/255; fading around it changes the image very little.
  const auto [degree, filter] = GetParam();
  const Splats splats = random_splats(600, degree, filter, 2);
  SplatOptions options;
  options.order = SplatOrder::depth;
  const Sample sample = render(splats, options);
  const Image<SplatPixel> published = render_slowly(splats, kPinhole, {}, {SplatRules::Order::depth, false});
  double sum = 0;
  for (int y = 0; y < kPinhole.height; ++y) {
    for (int x = 0; x < kPinhole.width; ++x)
      sum += std::pow(double{sample.irradiance(x, y)} - luminance_of(published(x, y)), 2);
  }
  EXPECT_GT(-10 * std::log10(sum / (kPinhole.width * kPinhole.height)), 55);
}

INSTANTIATE_TEST_SUITE_P(All, SplatsOfEachKind,
                         testing::Combine(testing::Values(0, 1, 2, 3),
                                          testing::Values(SplatFilter::dilated, SplatFilter::antialiased,
                                                          SplatFilter::mip)));

TEST(SplatRenderer, UnscentedProjectionIsThatOfAPinholeWithoutDistortion) {
  const Splats splats = random_splats(600, 1, SplatFilter::dilated, 3);
  SplatOptions options;
  options.projection = SplatProjection::unscented;
  EXPECT_GT(psnr(render(splats, options).irradiance, render(splats).irradiance), 35);
}

TEST(SplatRenderer, ShowsSplatsWhereTheLensShowsThem) {
  for (int kind = 0; kind < 4; ++kind) {
    const Camera camera = test::distorted_camera(kind);
    for (const auto& at :
         {Eigen::Vector3f(0, 0, 2), Eigen::Vector3f(-0.7F, 0.3F, 2), Eigen::Vector3f(0.9F, -0.6F, 2)}) {
      const Sample sample = render(one_splat(at, Eigen::Vector3f::Constant(0.02F), 0.9F, 1), {}, camera);
      double x_sum = 0, y_sum = 0, sum = 0;
      for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
          const double light = sample.irradiance(x, y);
          sum += light, x_sum += x * light, y_sum += y * light;
        }
      }
      const Eigen::Vector2d expected = camera.project(at.cast<double>())->pixel;
      EXPECT_NEAR(x_sum / sum, expected.x(), 0.02) << kind;
      EXPECT_NEAR(y_sum / sum, expected.y(), 0.02) << kind;
    }
  }
}

TEST(SplatRenderer, BlendsInTheSpaceOfTheColours) {
  // Two wide splats, one behind the other: blended in display colours, then converted.
  Splats splats = one_splat({0, 0, 1}, {5, 5, 0}, 0.5F, 0.8F);
  const Splats behind = one_splat({0, 0, 2}, {10, 10, 0}, 0.99F, 0.2F);
  splats.positions.push_back(behind.positions[0]), splats.deviations.push_back(behind.deviations[0]);
  splats.rotations.push_back(behind.rotations[0]), splats.opacities.push_back(behind.opacities[0]);
  splats.harmonics.insert(splats.harmonics.end(), behind.harmonics.begin(), behind.harmonics.end());
  const Camera camera{9, 9, 100, 100, 4, 4, NoDistortion{}};
  const double blended = 0.5 * 0.8 + 0.5 * 0.99 * 0.2;
  EXPECT_NEAR(render(splats, {}, camera).irradiance(4, 4), blended, 1e-4);
  splats.light = SplatLight::display;
  const double linear = std::pow((blended + 0.055) / 1.055, 2.4);
  EXPECT_NEAR(render(splats, {}, camera).irradiance(4, 4), linear, 1e-4);
  SplatOptions options;
  options.display_gamma = 2.2;
  options.gain = 3;
  EXPECT_NEAR(render(splats, options, camera).irradiance(4, 4), 3 * std::pow(blended, 2.2), 3e-4);
}

TEST(SplatRenderer, ShowsTheBackgroundBetweenSplats) {
  Splats splats = one_splat({0, 0, 1}, {5, 5, 0}, 0.5F, 1);
  SplatOptions options;
  options.background = 0.3F;
  const Camera camera{9, 9, 100, 100, 4, 4, NoDistortion{}};
  EXPECT_NEAR(render(splats, options, camera).irradiance(4, 4), 0.5 + 0.5 * 0.3, 1e-4);
  splats.light = SplatLight::display;
  const double encoded = 0.5 + 0.5 * (1.055 * std::pow(0.3, 1 / 2.4) - 0.055);
  EXPECT_NEAR(render(splats, options, camera).irradiance(4, 4), std::pow((encoded + 0.055) / 1.055, 2.4), 1e-4);
}

TEST(SplatRenderer, TurningTheCameraDoesNotChangeTheOrder) {
  // A turn by whole pixels about the image's centre: with distances, and with depths on rays, what a ray sees stays the
  // same.
  const Splats splats = random_splats(2000, 0, SplatFilter::antialiased, 4);
  Kinematics turned;
  turned.T_world_body.rotation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
  const Camera camera{64, 64, 60, 60, 31.5, 31.5, NoDistortion{}};
  for (const SplatOrder order : {SplatOrder::distance, SplatOrder::ray}) {
    SplatOptions options;
    options.order = order;
    const Sample before = render(splats, options, camera), after = render(splats, options, camera, turned);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) ASSERT_NEAR(after.irradiance(y, 63 - x), before.irradiance(x, y), 1e-4);
    }
  }
}

/// Splats that are larger than the distances between them, so that most of them pass through each other.
Splats interpenetrating_splats(std::size_t count, unsigned seed) {
  Splats splats = random_splats(count, 0, SplatFilter::mip, seed);
  for (std::size_t i = 0; i < count; ++i) {
    splats.deviations[i] *= 10;
    splats.opacities[i] *= i % 3 == 0 ? 1.0F : 0.1F;
  }
  return splats;
}

TEST(SplatRenderer, SortsInterpenetratingSplatsInEachPixel) {
  SplatOptions options;
  options.order = SplatOrder::ray;
  for (unsigned seed = 20; seed < 22; ++seed) {
    const Splats splats = interpenetrating_splats(300, seed);
    const Image<SplatPixel> expected = render_slowly(splats, kPinhole, {}, {SplatRules::Order::ray});
    EXPECT_LE(different_pixels(render(splats, options), expected, 1e-3), kPinhole.width * kPinhole.height / 1000);
    const Image<SplatPixel> by_distance = render_slowly(splats, kPinhole, {}, {SplatRules::Order::distance});
    EXPECT_GT(largest_difference(render(splats, options), by_distance), 0.05) << "the orders should differ";
  }
}

TEST(SplatRenderer, BlendsCrossingDiscsInOppositeOrdersOnBothSides) {
  // Two opaque discs that cross along the image's middle column at right angles: the nearer half of each is seen.
  Splats splats = one_splat({0, 0, 2}, {100, 100, 0}, 0.99F, 1);
  splats.positions.emplace_back(0, 0, 2), splats.deviations.emplace_back(100, 100, 0),
      splats.opacities.push_back(0.99F);
  splats.harmonics.insert(splats.harmonics.end(), 3, (0.2F - 0.5F) / 0.28209479F);
  splats.rotations.clear();
  for (const float angle : {0.785398F, -0.785398F})
    splats.rotations.emplace_back(0, std::sin(0.5F * angle), 0, std::cos(0.5F * angle));
  SplatOptions options;
  options.order = SplatOrder::ray;
  const Camera camera{41, 21, 40, 40, 20, 10, NoDistortion{}};
  const Sample sample = render(splats, options, camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 2; x < camera.width - 2; ++x) {
      if (x == 20) continue;
      const bool first_in_front = x > 20;  // it turns its right side towards the camera
      EXPECT_NEAR(sample.irradiance(x, y), first_in_front ? 0.99 * 1 + 0.0099 * 0.2 : 0.99 * 0.2 + 0.0099 * 1, 0.01)
          << x << ", " << y;
    }
  }
}

TEST(SplatRenderer, SortsTilesAsTheFrameAndWithAnyNumberOfThreads) {
  const Splats splats = interpenetrating_splats(300, 30);
  SplatOptions options;
  options.order = SplatOrder::ray;
  const Workers one(1), three(3);
  const auto renderer = make_splat_renderer(scene_of(splats), options, kPinhole, one);
  const Sample frame = test::render(*renderer, kPinhole, {});
  const Sample same = test::render(*make_splat_renderer(scene_of(splats), options, kPinhole, three), kPinhole, {});
  EXPECT_TRUE(std::ranges::equal(frame.irradiance.pixels(), same.irradiance.pixels()));
  EXPECT_TRUE(std::ranges::equal(frame.depth.pixels(), same.depth.pixels()));
  for (const Tile& tile : {Tile{0, 0, 1, 1}, Tile{17, 3, 35, 21}, Tile{90, 60, 6, 12}, Tile{5, 31, 80, 2}}) {
    Sample part;
    renderer->render({0, {}, {tile}}, part);
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        ASSERT_EQ(part.irradiance(x, y), frame.irradiance(x, y)) << x << ", " << y;
        ASSERT_EQ(part.depth(x, y), frame.depth(x, y)) << x << ", " << y;
      }
    }
  }
}

/// Irradiances of a pixel while the camera moves by 1 m in steps of 1 mm.
std::vector<float> path_of(const Splats& splats, const Eigen::Vector3d& direction) {
  const Camera camera{16, 16, 20, 20, 7.5, 7.5, NoDistortion{}};
  const auto renderer = make_splat_renderer(scene_of(splats), {}, camera, test::two_threads());
  std::vector<float> path;
  for (int i = 0; i < 1000; ++i) {
    Kinematics pose;
    pose.T_world_body.translation = i * 1e-3 * direction;
    path.push_back(test::render(*renderer, camera, pose).irradiance(7, 7));
  }
  return path;
}

TEST(SplatRenderer, SplatsPassTheCameraAndTheImageWithoutSteps) {
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0)}) {
    const Eigen::Vector3f position(direction.x() > 0 ? 0.3F : 0.0F, 0, 0.5F);
    for (const float opacity : {0.02F, 0.9F}) {
      const std::vector<float> path = path_of(one_splat(position, {0.05F, 0.07F, 0.02F}, opacity, 1), direction);
      EXPECT_GT(*std::ranges::max_element(path), 0.5F * opacity);
      EXPECT_LT(path.back(), 1e-6F);
      for (std::size_t i = 1; i < path.size(); ++i) ASSERT_LT(std::abs(path[i] - path[i - 1]), 0.25F * opacity) << i;
    }
  }
}

class SplatsInEachOrder : public testing::TestWithParam<SplatOrder> {
 protected:
  SplatsInEachOrder() { options.order = GetParam(); }
  SplatOptions options;
};
INSTANTIATE_TEST_SUITE_P(All, SplatsInEachOrder,
                         testing::Values(SplatOrder::distance, SplatOrder::depth, SplatOrder::ray));

TEST_P(SplatsInEachOrder, MeshesHideWhatIsBehindThem) {
  // A white splat 2 m away, which is nearly even, and one 1 m away at the left; a mesh 1.5 m away.
  Splats splats = one_splat({0, 0, 2}, {100, 100, 0}, 0.99F, 1);
  const Splats front = one_splat({-0.5F, 0, 1}, {0.1F, 0.1F, 0}, 0.99F, 0.5F);
  splats.positions.push_back(front.positions[0]), splats.deviations.push_back(front.deviations[0]);
  splats.rotations.push_back(front.rotations[0]), splats.opacities.push_back(front.opacities[0]);
  splats.harmonics.insert(splats.harmonics.end(), front.harmonics.begin(), front.harmonics.end());
  Mesh mesh;
  mesh.vertices = {{-5, -5, 1.5F}, {0, -5, 1.5F}, {0, 5, 1.5F}, {-5, 5, 1.5F}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.texture_uv.resize(2);
  mesh.material = {0, 0};
  mesh.materials = {{"grey", nullptr, 0.25F}};
  Scene scene;
  scene.objects.push_back({"wall", mesh, true});
  const Camera camera{65, 33, 32, 32, 32, 16, NoDistortion{}};
  SplatSurfaces surfaces{make_raster_renderer(build_raster_scene(scene), {}, camera, test::two_threads()), {1}};
  const auto moving = build_splat_scene({{std::make_shared<const Splats>(splats), 0}});
  const auto renderer =
      make_splat_renderer(moving, options, camera, test::two_threads(), ColourFilters::none, 1, std::move(surfaces));
  Sample sample;
  renderer->render({0, {}, {{0, 0, 65, 33}}, {Kinematics{}, Kinematics{}}, true}, sample);
  const auto expect = [&](int x, double light, double depth, int object) {
    EXPECT_NEAR(sample.irradiance(x, 16), light, 2e-3) << x;
    EXPECT_NEAR(sample.depth(x, 16), depth, 1e-3) << x;
    EXPECT_EQ(sample.object(x, 16), object) << x;
  };
  expect(16, 0.99 * 0.5 + 0.01 * 0.25, 1, 1);  // the splat in front
  expect(2, 0.25, 1.5, 2);                     // the mesh
  expect(60, 0.99, 2, 1);                      // the splat behind, beside the mesh
}

TEST_P(SplatsInEachOrder, BearDamagedAndExtremeSplats) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNaN = std::numeric_limits<float>::quiet_NaN();
  const Splats good = random_splats(300, 1, SplatFilter::mip, 6);
  const auto with = [&](const Eigen::Vector3f& position, const Eigen::Vector3f& deviations, float opacity) {
    Splats splats = good;
    splats.positions[7] = position, splats.deviations[7] = deviations, splats.opacities[7] = opacity;
    return render(splats, options);
  };
  const Eigen::Vector3f here(0, 0, 2), small(0.01F, 0.01F, 0.01F);
  for (const Sample& sample :
       {with({kNaN, 0, 1}, small, 1), with({kInfinity, 0, 1}, small, 1), with({1e30F, 1e30F, 1e30F}, small, 1),
        with(here, {1e6F, 1e-12F, 0}, 1), with(here, {1e20F, 1e20F, 1e20F}, 1), with(here, {0, 0, 0}, 1),
        with({0, 0, 0}, {1, 1, 1}, 1), with({0, 0, 1e-20F}, small, 1), with({1e-3F, 0, 0.011F}, {1, 1, 1}, 1)}) {
    for (const float value : sample.irradiance.pixels()) ASSERT_TRUE(std::isfinite(value) && value >= 0 && value < 100);
    for (const float value : sample.depth.pixels()) ASSERT_GT(value, 0);
  }
}

TEST_P(SplatsInEachOrder, ManySplatsAtOnePlace) {
  Splats splats = one_splat({0, 0, 2}, {0.01F, 0.01F, 0.01F}, 0.01F, 1);
  constexpr std::size_t kMany = 20000;
  splats.positions.resize(kMany, splats.positions[0]), splats.deviations.resize(kMany, splats.deviations[0]);
  splats.rotations.resize(kMany, splats.rotations[0]), splats.opacities.resize(kMany, 0.01F);
  splats.harmonics.resize(kMany * 3, splats.harmonics[0]);
  EXPECT_NEAR(render(splats, options).irradiance(46, 37), 1, 1e-3);
}

}  // namespace
}  // namespace esim
