#include "esim/geometry/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "esim/core/error.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::contains;
using test::largest_difference;
using test::numeric_jacobian;

struct NamedCamera {
  const char* name;
  Camera camera;
};

// Calibrations of real event cameras (Event Camera Dataset, a quadrotor, a wide lens), and strong invented ones.
const std::vector<NamedCamera> kCameras{
    {"pinhole", {640, 480, 400.0, 410.0, 321.5, 236.25, NoDistortion{}}},
    {"radial_tangential",
     {240, 180, 199.37143467278824, 199.7078674353677, 133.75438071590816, 113.99216995027632,
      RadialTangential{-0.38289915571515265, 0.18933636521343228, -0.0010024743349031492, -0.0005637766302076818}}},
    {"barrel_with_limit", {240, 180, 199.0, 201.0, 119.5, 89.5, RadialTangential{-0.25, 0.0, 0.002, -0.003, 0.01}}},
    {"pincushion", {240, 180, 199.0, 201.0, 119.5, 89.5, RadialTangential{0.4, 0.2, -0.004, 0.006, 0.1}}},
    {"equidistant",
     {346, 260, 235.90001575, 235.84153994, 170.45862273, 130.11022812,
      Equidistant{-0.13853153, -0.04153486, 0.00805515, 0.00423045}}},
    {"equidistant_wide",
     {240, 180, 198.245521288, 198.277025706, 142.064861206, 100.903484508,
      Equidistant{-0.0506755889541, 0.0456313630037, -0.0825742639337, 0.0557104403236}}},
    {"fov", {640, 480, 0.45 * 640, 0.6 * 480, 322.0, 239.0, Fov{0.93}}},
    {"nearly_no_fov", {640, 480, 400.0, 400.0, 319.5, 239.5, Fov{1e-4}}},
};

class CameraModel : public testing::TestWithParam<NamedCamera> {
 protected:
  const Camera& camera() const { return GetParam().camera; }
  Vector2d project(const Vector3d& point) const { return camera().project(point).value().pixel; }
  Vector3d bearing(const Vector2d& pixel) const { return camera().back_project(pixel).value().bearing; }
};

INSTANTIATE_TEST_SUITE_P(Models, CameraModel, testing::ValuesIn(kCameras),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST_P(CameraModel, IsValid) { EXPECT_NO_THROW(camera().validate()); }

TEST_P(CameraModel, BackProjectionAndProjectionAreInverseAtEveryPixel) {
  double largest = 0.0;
  for (int y = 0; y < camera().height; ++y) {
    for (int x = 0; x < camera().width; ++x) {
      const Vector2d pixel(x, y);
      const Vector3d direction = bearing(pixel);
      ASSERT_EQ(direction.z(), 1.0);
      largest = std::max(largest, (project(3.7 * direction) - pixel).norm());
    }
  }
  EXPECT_LT(largest, 1e-10);
}

TEST_P(CameraModel, ProjectionDoesNotDependOnDepth) {
  const Vector3d direction = bearing({30.0, 170.0});
  EXPECT_LT(largest_difference(project(1e-9 * direction), project(1e9 * direction)), 1e-10);
}

TEST_P(CameraModel, ProjectsTheOpticalAxisToThePrincipalPoint) {
  EXPECT_EQ(project({0.0, 0.0, 2.0}), Vector2d(camera().cx, camera().cy));
  EXPECT_EQ(bearing({camera().cx, camera().cy}), Vector3d(0.0, 0.0, 1.0));
}

TEST_P(CameraModel, JacobianOfTheProjectionIsItsDerivative) {
  const auto projected = [&](const Vector3d& p) -> Vector2d { return project(p); };
  std::vector<Vector3d> points{{0.0, 0.0, 1.5}, {1e-9, 0.0, 1.0}};
  for (const double x : {0.0, 37.25, 120.0, 239.0}) {
    for (const double y : {0.0, 91.75, 179.0}) points.push_back(2.0 * bearing({x, y}));
  }
  for (const Vector3d& point : points) {
    const auto jacobian = camera().project(point).value().jacobian;
    EXPECT_LT(largest_difference(jacobian, numeric_jacobian(projected, point)), 1e-6) << point.transpose();
  }
}

TEST_P(CameraModel, JacobianOfTheBackProjectionIsItsDerivative) {
  const auto direction = [&](const Vector2d& p) -> Vector3d { return bearing(p); };
  for (const double x : {2.0, 37.25, 120.0, camera().cx, 237.0}) {
    for (const double y : {2.0, 91.75, camera().cy, 177.0}) {
      const Vector2d pixel(x, y);
      const auto back = camera().back_project(pixel).value();
      EXPECT_LT(largest_difference(back.jacobian, numeric_jacobian(direction, pixel, 0.1)), 1e-9) << x << ' ' << y;
      EXPECT_LT(largest_difference(camera().project(back.bearing).value().jacobian * back.jacobian,
                                   Eigen::Matrix2d::Identity()),
                1e-12);
    }
  }
}

TEST_P(CameraModel, SeesNothingBehindItself) {
  EXPECT_FALSE(camera().project({0.1, 0.1, 0.0}));
  EXPECT_FALSE(camera().project({0.0, 0.0, 0.0}));
  EXPECT_FALSE(camera().project({0.1, 0.1, -1.0}));
  EXPECT_FALSE(camera().project({0.1, 0.1, std::nan("")}));
  EXPECT_FALSE(camera().project({std::nan(""), 0.1, 1.0}));
  EXPECT_FALSE(camera().project({1e300, 1e300, 1e-300}));
  EXPECT_FALSE(camera().back_project({std::nan(""), 1.0}));
  EXPECT_FALSE(camera().back_project({std::numeric_limits<double>::infinity(), 1.0}));
}

// Formulas evaluated by hand.

TEST(Camera, RadialTangentialFollowsItsFormula) {
  const Camera camera{100, 100, 100.0, 200.0, 50.0, 40.0, RadialTangential{0.1, 0.01, 0.001, 0.002, 0.003}};
  // x = 0.5, y = -0.25: r² = 0.3125, radial factor 1 + 0.03125 + 0.0009765625 + 0.000091552734375.
  const double factor = 1.032318115234375;
  const double x = 0.5 * factor + 2 * 0.001 * 0.5 * -0.25 + 0.002 * (0.3125 + 2 * 0.25);
  const double y = -0.25 * factor + 0.001 * (0.3125 + 2 * 0.0625) + 2 * 0.002 * 0.5 * -0.25;
  const Vector2d pixel = camera.project({1.0, -0.5, 2.0}).value().pixel;
  EXPECT_NEAR(pixel.x(), 100.0 * x + 50.0, 1e-12);
  EXPECT_NEAR(pixel.y(), 200.0 * y + 40.0, 1e-12);
}

TEST(Camera, EquidistantFollowsItsFormula) {
  const Camera camera{100, 100, 100.0, 100.0, 0.0, 0.0, Equidistant{0.1, 0.02, 0.003, 0.0004}};
  const double theta = std::numbers::pi / 4.0, s = theta * theta;
  const double radius = theta * (1.0 + s * (0.1 + s * (0.02 + s * (0.003 + s * 0.0004))));
  const Vector2d pixel = camera.project({0.6, 0.8, 1.0}).value().pixel;
  EXPECT_NEAR(pixel.x(), 60.0 * radius, 1e-12);
  EXPECT_NEAR(pixel.y(), 80.0 * radius, 1e-12);
}

TEST(Camera, FovFollowsItsFormula) {
  const Camera camera{100, 100, 100.0, 100.0, 0.0, 0.0, Fov{0.8}};
  const double radius = std::atan(2.0 * std::tan(0.4)) / 0.8;
  const Vector2d pixel = camera.project({0.6, 0.8, 1.0}).value().pixel;
  EXPECT_NEAR(pixel.x(), 60.0 * radius, 1e-12);
  EXPECT_NEAR(pixel.y(), 80.0 * radius, 1e-12);
}

// Domains.

TEST(Camera, RefusesPointsBeyondTheFoldOfBarrelDistortion) {
  // d/dr (r − 0.3 r³) vanishes at r = 1/sqrt(0.9); the image would come back to its centre at r = 1/sqrt(0.3).
  const Camera camera{240, 180, 200.0, 200.0, 119.5, 89.5, RadialTangential{-0.3, 0.0, 0.0, 0.0}};
  const double limit = 1.0 / std::sqrt(0.9);
  EXPECT_TRUE(camera.project({limit * (1.0 - 1e-9), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({limit * (1.0 + 1e-9), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({1.0 / std::sqrt(0.3), 0.0, 1.0}));
  const double largest_radius = 2.0 / 3.0 * limit * 200.0;
  EXPECT_TRUE(camera.back_project({119.5, 89.5 - largest_radius * (1.0 - 1e-9)}));
  EXPECT_FALSE(camera.back_project({119.5, 89.5 - largest_radius * (1.0 + 1e-9)}));
}

TEST(Camera, RefusesPointsWhereTheDistortionGrowsASecondTime) {
  // 1 − 3 s + 1.5 s² is negative for s = r² between 0.42 and 1.58 and positive again beyond.
  const Camera camera{240, 180, 200.0, 200.0, 119.5, 89.5, RadialTangential{-1.0, 0.3, 0.0, 0.0}};
  EXPECT_TRUE(camera.project({std::sqrt(0.42), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({std::sqrt(0.43), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({std::sqrt(1.0), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({std::sqrt(2.0), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({30.0, 40.0, 1.0}));
}

TEST(Camera, RefusesPointsBeyondANarrowDip) {
  // (1 − s/0.5)² + e, times (1 + s): positive everywhere for e > 0, not for e < 0, however small.
  const auto with_slope = [](double e) {
    const double c1 = (1.0 + e - 4.0) / (1.0 + e), c2 = (4.0 - 4.0) / (1.0 + e), c3 = 4.0 / (1.0 + e);
    return Camera{240, 180, 200.0, 200.0, 119.5, 89.5, RadialTangential{c1 / 3.0, c2 / 5.0, 0.0, 0.0, c3 / 7.0}};
  };
  EXPECT_TRUE(with_slope(1e-6).project({1.0, 0.0, 1.0}));
  EXPECT_FALSE(with_slope(-1e-6).project({1.0, 0.0, 1.0}));
  EXPECT_TRUE(with_slope(-1e-6).project({0.7, 0.0, 1.0}));
}

TEST(Camera, RefusesPointsBeyondTheFoldOfEquidistantDistortion) {
  // d/dθ (θ − 0.3 θ³) vanishes at θ = 1/sqrt(0.9) = 1.054 < π/2.
  const Camera camera{240, 180, 200.0, 200.0, 119.5, 89.5, Equidistant{-0.3, 0.0, 0.0, 0.0}};
  const double limit = 1.0 / std::sqrt(0.9);
  EXPECT_TRUE(camera.project({std::tan(limit - 1e-9), 0.0, 1.0}));
  EXPECT_FALSE(camera.project({std::tan(limit + 1e-9), 0.0, 1.0}));
  EXPECT_TRUE(camera.back_project({119.5 + 200.0 * (2.0 / 3.0 * limit - 1e-9), 89.5}));
  EXPECT_FALSE(camera.back_project({119.5 + 200.0 * (2.0 / 3.0 * limit + 1e-9), 89.5}));
}

TEST(Camera, EquidistantAndFovEndAtARightAngle) {
  const Camera equidistant{400, 400, 100.0, 100.0, 199.5, 199.5, Equidistant{}};
  const double edge = 100.0 * std::numbers::pi / 2.0;
  EXPECT_NEAR(equidistant.back_project({199.5 + edge - 1e-6, 199.5}).value().bearing.x(), 1e8, 100.0);
  EXPECT_FALSE(equidistant.back_project({199.5 + edge + 1e-6, 199.5}));
  const Camera fov{400, 400, 100.0, 100.0, 199.5, 199.5, Fov{1.0}};
  EXPECT_TRUE(fov.back_project({199.5 + edge - 1e-6, 199.5}));
  EXPECT_FALSE(fov.back_project({199.5 + edge + 1e-6, 199.5}));
}

TEST(Camera, NoTwoPointsOfARandomDomainShareAPixel) {
  // Back-projection must invert projection, even for absurd coefficients.
  std::mt19937 engine(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int projected = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    const double a = uniform(engine), b = uniform(engine), c = uniform(engine), d = uniform(engine);
    Camera camera{240, 180, 200.0, 200.0, 119.5, 89.5, RadialTangential{a, b, 0.02 * c, 0.02 * d, uniform(engine)}};
    if (i % 2 == 1) camera.distortion = Equidistant{a, b, c, d};
    const Vector3d point(1.5 * uniform(engine), 1.5 * uniform(engine), 1.0);
    const auto projection = camera.project(point);
    if (!projection) {
      ++refused;
      continue;
    }
    ++projected;
    const auto back = camera.back_project(projection->pixel);
    ASSERT_TRUE(back) << i;
    // Close to a fold, many points differ by rounding only from one pixel.
    const double tolerance = 1e-12 * (1.0 + back->jacobian.norm() * 200.0);
    ASSERT_LT((back->bearing - point).norm(), tolerance) << i << ": " << point.transpose();
  }
  EXPECT_GT(projected, 5000);
  EXPECT_GT(refused, 2000);
}

// Construction and validation.

TEST(Camera, FromFovSpansTheImageBorderToBorder) {
  const Camera camera = Camera::from_fov(640, 480, std::numbers::pi / 2.0);
  EXPECT_NEAR(camera.back_project({-0.5, 239.5}).value().bearing.x(), -1.0, 1e-15);
  EXPECT_NEAR(camera.back_project({639.5, 239.5}).value().bearing.x(), 1.0, 1e-15);
  EXPECT_NEAR(camera.back_project({319.5, -0.5}).value().bearing.y(), -0.75, 1e-15);
  EXPECT_NO_THROW(camera.validate());
  EXPECT_THROW(Camera::from_fov(640, 480, 0.0), UserError);
  EXPECT_THROW(Camera::from_fov(640, 480, std::numbers::pi), UserError);
  EXPECT_THROW(Camera::from_fov(640, 480, std::nan("")), UserError);
  EXPECT_THROW(Camera::from_fov(0, 480, 1.0), UserError);
}

std::string error_of(const Camera& camera) {
  return test::message_of<UserError>([&] { camera.validate(); });
}

TEST(Camera, ValidationNamesWhatIsWrong) {
  const Camera good = Camera::from_fov(240, 180, 1.0);
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  const auto error_with = [&](auto change) {
    Camera camera = good;
    change(camera);
    return error_of(camera);
  };
  EXPECT_EQ(error_of(good), "nothing was thrown");
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.width = 0; }), "0 x 180"));
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.height = -3; }), "240 x -3"));
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.fx = 0.0; }), "fx is 0 px"));
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.fy = -100.0; }), "fy is -100 px"));
  EXPECT_TRUE(contains(error_with([&](Camera& c) { c.fy = infinity; }), "fy is inf"));
  EXPECT_TRUE(contains(error_with([&](Camera& c) { c.cx = nan; }), "cx is nan"));
  EXPECT_TRUE(contains(error_with([&](Camera& c) { c.cy = infinity; }), "cy is inf"));
  EXPECT_TRUE(contains(error_with([&](Camera& c) { c.distortion = RadialTangential{0, 0, 0, nan}; }), "p2"));
  EXPECT_TRUE(contains(error_with([&](Camera& c) { c.distortion = Equidistant{0, 0, infinity}; }), "k3"));
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.distortion = Fov{0.0}; }), "w is 0"));
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.distortion = Fov{-1.0}; }), "w is -1"));
  EXPECT_TRUE(contains(error_with([](Camera& c) { c.distortion = Fov{4.0}; }), "w is 4"));
}

TEST(Camera, ValidationNamesThePixelThatTheDistortionCannotReach) {
  // Only the lower right corner is invalid: the principal point is in the upper left.
  const Camera corner{240, 180, 200.0, 200.0, 0.0, 0.0, RadialTangential{-0.066, 0.0, 0.0, 0.0}};
  EXPECT_EQ(error_of(corner), "nothing was thrown");
  const Camera folded{240, 180, 200.0, 200.0, 0.0, 0.0, RadialTangential{-0.0665, 0.0, 0.0, 0.0}};
  EXPECT_TRUE(contains(error_of(folded), "pixel (239, 179)"));
  const Camera fisheye{400, 400, 120.0, 120.0, 199.5, 199.5, Equidistant{}};
  EXPECT_TRUE(contains(error_of(fisheye), "pixel (0, 0)"));
}

}  // namespace
}  // namespace esim
