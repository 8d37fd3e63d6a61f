// Shadows by shadow maps against shadows by rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/scenes.h"

namespace esim {
namespace {

class GlShadowsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  }
};

const Camera kCamera = Camera::from_fov(240, 180, 1.3);

RenderRequest request_of(const Camera& model, const Kinematics& camera, std::vector<Kinematics> objects = {}) {
  return {5, camera, {{0, 0, model.width, model.height}}, std::move(objects)};
}

/// A camera at `position` that looks at `target`, its x axis level.
Kinematics looking(const Eigen::Vector3d& position, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - position).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R.col(0) = x, R.col(1) = z.cross(x), R.col(2) = z;
  Kinematics camera;
  camera.T_world_body = {Eigen::Quaterniond(R), position};
  return camera;
}

/// A white box around its origin, flat on each side.
Mesh white_box(const Eigen::Vector3f& half) {
  Mesh mesh = test::box_mesh();
  mesh.materials[0].texture = nullptr;
  mesh.materials[0].base = 0.8F;
  for (Eigen::Vector3f& vertex : mesh.vertices)
    vertex = {vertex.x() * half.x() / 4, vertex.y() * half.y() / 3, vertex.z() * half.z() / 2};
  return mesh;
}

Mesh moved(Mesh mesh, const Eigen::Vector3f& by) {
  for (Eigen::Vector3f& vertex : mesh.vertices) vertex += by;
  return mesh;
}

/// A room of 8 x 6 x 4 m with a box and a ball on its floor.
Scene furnished_room(Lighting lighting) {
  lighting.shadows = true;
  Scene scene = still_scene(white_box({4, 3, 2}));
  scene.objects.push_back({"box", moved(white_box({0.4F, 0.3F, 0.5F}), {1.5F, 0.3F, -1.5F})});
  scene.objects.push_back({"ball", moved(test::ball_mesh(0.4F, 24), {1.0F, -0.8F, -1.6F})});
  scene.lighting = lighting;
  return scene;
}

/// The same scene outdoors, without walls and ceiling.
Scene furnished_floor(const Lighting& lighting) {
  Scene scene = furnished_room(lighting);
  scene.objects[0].mesh = moved(white_box({4, 3, 0.1F}), {0, 0, -2.1F});
  return scene;
}

Lighting sun(const Eigen::Vector3f& direction) {
  Lighting lighting;
  lighting.ambient = 0.2F;
  lighting.suns.push_back({direction, 0.9F});
  return lighting;
}

Lighting lamp(const Eigen::Vector3f& position) {
  Lighting lighting;
  lighting.ambient = 0.2F;
  lighting.points.push_back({position, 3.0F});
  return lighting;
}

Sample rendered(Renderer& renderer, const RenderRequest& request) {
  Sample sample;
  renderer.render(request, sample);
  return sample;
}

/// Whether an image changes by less than `max` within two pixels around one.
bool is_smooth(const Image<float>& image, int x, int y, float max) {
  constexpr int kReach = 2;
  float low = image(x, y), high = low;
  for (int v = std::max(0, y - kReach); v <= std::min(image.height() - 1, y + kReach); ++v) {
    for (int u = std::max(0, x - kReach); u <= std::min(image.width() - 1, x + kReach); ++u)
      low = std::min(low, image(u, v)), high = std::max(high, image(u, v));
  }
  return high - low < max;
}

/// Differences of E from the expected sample; `without` has no shadows.
struct Difference {
  double mean = 0;
  double largest = 0;   ///< away from all edges, including those of shadows
  double compared = 0;  ///< fraction of pixels that are compared
  double shadows = 0;   ///< fraction of pixels in shadow
};

Difference compare(const Sample& expected, const Sample& without, const Sample& sample) {
  Difference result;
  const Image<float>& E = expected.irradiance;
  Image<float> lost = E;
  for (std::size_t i = 0; i < E.size(); ++i) lost.pixels()[i] = without.irradiance.pixels()[i] - E.pixels()[i];
  for (int y = 0; y < E.height(); ++y) {
    for (int x = 0; x < E.width(); ++x) {
      const double off = std::fabs(double{E(x, y)} - sample.irradiance(x, y)),
                   share = 1 / static_cast<double>(E.size());
      result.mean += share * off;
      if (lost(x, y) > 0.05F) result.shadows += share;
      if (!is_smooth(E, x, y, 0.06F * E(x, y)) || !is_smooth(lost, x, y, 0.01F)) continue;
      result.largest = std::max(result.largest, off);
      result.compared += share;
    }
  }
  return result;
}

void expect_agreement(const Scene& scene, const RenderRequest& request, const Camera& model, const std::string& name) {
  SCOPED_TRACE(name);
  const auto cast = make_raycast_renderer(build_raycast_scene(scene), {}, model, test::two_threads());
  const auto gl = make_gl_renderer(scene, {}, model);
  const Sample expected = rendered(*cast, request), sample = rendered(*gl, request);
  Scene bright = scene;
  bright.lighting->shadows = false;
  const auto cast_bright = make_raycast_renderer(build_raycast_scene(bright), {}, model, test::two_threads());
  const Difference difference = compare(expected, rendered(*cast_bright, request), sample);
  EXPECT_LT(difference.mean, 0.01);
  EXPECT_LT(difference.largest, 3e-3);
  EXPECT_GT(difference.compared, 0.5) << "too little is compared";
  EXPECT_GT(difference.shadows, 0.02) << "there should be shadows";
}

TEST_F(GlShadowsTest, OfASunAreThoseOfTheRayCaster) {
  const RenderRequest request = request_of(kCamera, looking({-1.5, -1, -0.2}, {1.2, 0, -1.7}));
  expect_agreement(furnished_floor(sun({-0.5F, 0.6F, -1})), request, kCamera, "sun");
  expect_agreement(furnished_floor(sun({-0.9F, 0.3F, -0.25F})), request, kCamera, "low_sun");
}

TEST_F(GlShadowsTest, OfALampAreThoseOfTheRayCaster) {
  const RenderRequest request = request_of(kCamera, looking({-1.5, -1, -0.2}, {1.2, 0, -1.7}));
  expect_agreement(furnished_room(lamp({0.3F, 0.9F, 0.2F})), request, kCamera, "lamp");
  expect_agreement(furnished_room(lamp({2.6F, -0.5F, -1.4F})), request, kCamera, "low_lamp");
}

TEST_F(GlShadowsTest, OfManyLightsThroughALensAreThoseOfTheRayCaster) {
  Lighting lighting = lamp({0.3F, 0.9F, 0.2F});
  lighting.points.push_back({{0.5F, -2.0F, 1.0F}, 2.0F});
  lighting.suns = {{{0.5F, 0.4F, -1}, 0.2F}, {{-0.3F, 0.7F, -1}, 0.2F}};
  const Camera model = test::distorted_camera(1);
  expect_agreement(furnished_floor(lighting), request_of(model, looking({-1.5, -1, -0.2}, {1.2, 0, -1.7})), model,
                   "many");
}

TEST_F(GlShadowsTest, MoveWithWhatCastsThem) {
  Lighting lighting = sun({0.5F, 0.4F, -1});
  lighting.points.push_back({{0.3F, 0.9F, 0.2F}, 2.0F});
  Scene scene = furnished_floor(lighting);
  scene.objects.push_back({"flying box", white_box({0.2F, 0.3F, 0.1F}), true});
  scene.objects.push_back({"flying ball", test::ball_mesh(0.15F, 16), true});
  Kinematics box, ball;
  for (const double t : {0.0, 0.7}) {
    box.T_world_body = {so3_exp(Eigen::Vector3d(0.3, 0.5 + t, -0.2)), {0.6, -0.4 + t, -1.2}};
    ball.T_world_body = {so3_exp(Eigen::Vector3d(0, 0, 0)), {1.2 + 0.3 * t, 0.3 - t, -0.6 - 0.3 * t}};
    const RenderRequest request = request_of(kCamera, looking({-1.5, -1, -0.2}, {1.2, 0, -1.7}), {box, ball});
    expect_agreement(scene, request, kCamera, "moving" + std::to_string(t));
  }
}

TEST_F(GlShadowsTest, HaveSmoothEdges) {
  // Many rays approximate the mean over a pixel's area; a single ray has steps.
  Lighting lighting = sun({-0.9F, 0.3F, -0.25F});
  Scene scene = furnished_floor(lighting);
  const auto built = build_raycast_scene(scene);
  for (const double distance : {0.5, 2.0}) {  // pixels that are finer and coarser than texels
    SCOPED_TRACE(distance);
    const Eigen::Vector3d edge(-0.1, 0.5, -2);
    const RenderRequest request =
        request_of(kCamera, looking(edge + distance * Eigen::Vector3d(-0.5, -0.4, 0.7), edge));
    const Sample exact = rendered(*make_raycast_renderer(built, {0.2F, 64}, kCamera, test::two_threads()), request);
    const Sample steps = rendered(*make_raycast_renderer(built, {}, kCamera, test::two_threads()), request);
    const Sample smooth = rendered(*make_gl_renderer(scene, {}, kCamera), request);
    double error_steps = 0, error_smooth = 0;
    for (std::size_t i = 0; i < exact.irradiance.size(); ++i) {
      error_steps += std::pow(steps.irradiance.pixels()[i] - exact.irradiance.pixels()[i], 2);
      error_smooth += std::pow(smooth.irradiance.pixels()[i] - exact.irradiance.pixels()[i], 2);
    }
    EXPECT_GT(error_steps, 0.1) << "there should be an edge";
    EXPECT_LT(error_smooth, 0.6 * error_steps);
  }
}

TEST_F(GlShadowsTest, NoPlaneShadowsItselfHoweverGrazingTheLight) {
  // The result must not depend on whether shadows are enabled.
  Kinematics camera = looking({-3, -0.4, -1.2}, {1, 0.2, -2});
  for (const double elevation : {0.5, 0.1, 0.03, 0.01}) {
    SCOPED_TRACE(elevation);
    const Eigen::Vector3f direction = Eigen::Vector3d(std::cos(0.7), std::sin(0.7), -elevation).cast<float>();
    for (const bool is_lamp : {false, true}) {
      Lighting lighting =
          is_lamp ? lamp(Eigen::Vector3f(0.5F, 0.3F, -2 + 4 * static_cast<float>(elevation))) : sun(direction);
      Scene scene = still_scene(moved(white_box({4, 3, 0.1F}), {0, 0, -2.1F}));
      scene.lighting = lighting;
      const auto bright = make_gl_renderer(scene, {}, kCamera);
      scene.lighting->shadows = true;
      const auto gl = make_gl_renderer(scene, {}, kCamera);
      const Sample expected = rendered(*bright, request_of(kCamera, camera)),
                   sample = rendered(*gl, request_of(kCamera, camera));
      int darker = 0;
      for (int y = 0; y < kCamera.height; ++y) {
        for (int x = 0; x < kCamera.width; ++x) {
          if (sample.irradiance(x, y) < 0.999F * expected.irradiance(x, y)) ++darker;
        }
      }
      EXPECT_EQ(darker, 0) << is_lamp;
    }
  }
}

TEST_F(GlShadowsTest, NoRoundBodyShadowsItsLitSide) {
  // A ball's facets: ray caster and map agree except at grazing light.
  for (const float radius : {0.02F, 1.0F, 30.0F}) {
    SCOPED_TRACE(radius);
    Scene scene = still_scene(test::ball_mesh(radius, 40));
    scene.lighting = sun({1, 0.5F, -0.5F});
    const auto camera = looking({-3 * radius, 0, 0}, {0, 0, 0});
    const auto bright = make_gl_renderer(scene, {}, kCamera);
    scene.lighting->shadows = true;
    const auto gl = make_gl_renderer(scene, {}, kCamera);
    const Sample expected = rendered(*bright, request_of(kCamera, camera)),
                 sample = rendered(*gl, request_of(kCamera, camera));
    for (std::size_t i = 0; i < sample.irradiance.size(); ++i) {
      const float lit = expected.irradiance.pixels()[i];
      if (lit < 0.2F + 0.2F * 0.9F) continue;  // ambient light only, or grazing light
      ASSERT_NEAR(sample.irradiance.pixels()[i], lit, 1e-4);
    }
  }
}

TEST_F(GlShadowsTest, BeginWhereThingsTouch) {
  // A box on the floor, lit from behind: the floor is dark from one or two pixels in front of the box.
  Lighting lighting = sun({-1, 0, -0.8F});
  Scene scene = furnished_floor(lighting);
  const Kinematics camera = looking({-1.5, 0.3, -0.8}, {1.1, 0.3, -2});
  const RenderRequest request = request_of(kCamera, camera);
  const Sample sample = rendered(*make_gl_renderer(scene, {}, kCamera), request);
  const auto image_of = [&](const Eigen::Vector3d& point) {
    return kCamera.project(camera.T_world_body.inverse() * point)->pixel;
  };
  const float dark = 0.2F * 0.8F;
  for (double y = 0.1; y < 0.5; y += 0.02) {
    const Eigen::Vector2d contact = image_of({1.1, y, -2});
    for (const int below : {2, 3, 5}) {
      const int u = static_cast<int>(std::lround(contact.x())), v = static_cast<int>(std::lround(contact.y())) + below;
      EXPECT_NEAR(sample.irradiance(u, v), dark, 1e-3) << u << ", " << v;
    }
  }
}

TEST_F(GlShadowsTest, ATileIsTheSameAsInTheWholeFrameAndNothingDependsOnHistory) {
  Lighting lighting = sun({0.5F, 0.4F, -1});
  lighting.points.push_back({{0.3F, 0.9F, 0.2F}, 2.0F});
  Scene scene = furnished_floor(lighting);
  scene.objects.push_back({"flying box", white_box({0.2F, 0.3F, 0.1F}), true});
  Kinematics box;
  box.T_world_body.translation = {0.6, -0.4, -1.2};
  const RenderRequest request = request_of(kCamera, looking({-1.5, -1, -0.2}, {1.2, 0, -1.7}), {box});
  const auto gl = make_gl_renderer(scene, {}, kCamera), other = make_gl_renderer(scene, {}, kCamera);
  const Sample whole = rendered(*gl, request);

  RenderRequest elsewhere = request;
  elsewhere.objects[0].T_world_body.translation = {2, 1, -1};
  elsewhere.camera.T_world_body.translation.x() += 0.3;
  rendered(*other, elsewhere);
  EXPECT_TRUE(std::ranges::equal(rendered(*other, request).irradiance.pixels(), whole.irradiance.pixels()));

  RenderRequest parts = request;
  parts.tiles = {{3, 5, 17, 9}, {100, 60, 80, 70}};
  const Sample sample = rendered(*other, parts);
  for (const Tile& tile : parts.tiles) {
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x)
        ASSERT_EQ(sample.irradiance(x, y), whole.irradiance(x, y)) << x << ", " << y;
    }
  }
}

}  // namespace
}  // namespace esim
