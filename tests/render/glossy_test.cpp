// Surfaces that shine, against the equations of glTF 2.0 in double precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "esim/core/error.h"
#include "esim/scene/texture_frame.h"
#include "render/scenes.h"

namespace esim {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

/// A surface and its parameters.
struct Reference {
  double base = 0.7, metallic = 0, roughness = 0.5, f0 = 0.04, f90 = 1;
  double widening = 0;  // of alpha²

  /// The function of glTF 2.0, appendix B, as its equations stand, times pi: 1 for white paper.
  double reflectance(const Vector3d& n, const Vector3d& l, const Vector3d& v) const {
    if (n.dot(l) <= 0 || n.dot(v) <= 0) return 0;
    const Vector3d h = (l + v).normalized();
    const double a2 = std::min(std::pow(roughness, 4) + widening, 1.0), n_h = n.dot(h), n_l = n.dot(l), n_v = n.dot(v);
    const double D = a2 / (kPi * std::pow(n_h * n_h * (a2 - 1) + 1, 2));
    const double V = 0.5 / (n_l * std::sqrt(n_v * n_v * (1 - a2) + a2) + n_v * std::sqrt(n_l * n_l * (1 - a2) + a2));
    const double schlick = std::pow(1 - v.dot(h), 5), fresnel = f0 + (f90 - f0) * schlick;
    const double dielectric = base * (1 - fresnel) + kPi * D * V * fresnel;
    const double metal = kPi * D * V * (base + (1 - base) * schlick);
    return dielectric + metallic * (metal - dielectric);
  }
};

Material shining(const Reference& surface) {
  Material material{"shining", nullptr, static_cast<float>(surface.base)};
  material.gloss =
      std::make_shared<const Gloss>(Gloss{static_cast<float>(surface.metallic), static_cast<float>(surface.roughness),
                                          static_cast<float>(surface.f0), static_cast<float>(surface.f90)});
  return material;
}

/// A square of 4 m in the plane z = 0, seen from above by its front.
Mesh square(const Material& material) {
  Mesh mesh;
  mesh.vertices = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Eigen::Vector2f a(0, 1), b(1, 1), c(1, 0), d(0, 0);  // u along x, v against y
  mesh.texture_uv = {{a, b, c}, {a, c, d}};
  mesh.material = {0, 0};
  mesh.materials = {material};
  return mesh;
}

Kinematics looking(const Vector3d& position, const Vector3d& target) {
  const Vector3d z = (target - position).normalized();
  const Vector3d x = z.cross(Vector3d(0.01, 0.02, 1)).normalized();
  Eigen::Matrix3d R;
  R.col(0) = x, R.col(1) = z.cross(x), R.col(2) = z;
  Kinematics camera;
  camera.T_world_body = {Eigen::Quaterniond(R), position};
  return camera;
}

Lighting glossy() {
  Lighting lighting;
  lighting.glossy = true;
  return lighting;
}

const Camera kModel = Camera::from_fov(48, 36, 0.8);

enum class Engine { raycast, raster, gl };
constexpr std::array kEngines = {Engine::raycast, Engine::raster, Engine::gl};

Sample seen(const Mesh& mesh, const Lighting& lighting, const Kinematics& camera, Engine engine = Engine::raycast,
            const Camera& model = kModel, int samples = 1) {
  Scene scene = still_scene(mesh);
  scene.lighting = lighting;
  const auto renderer = engine == Engine::raycast ? make_raycast_renderer(build_raycast_scene(scene), {0, samples},
                                                                          model, test::two_threads())
                        : engine == Engine::raster
                            ? make_raster_renderer(build_raster_scene(scene), {0, samples}, model, test::two_threads())
                            : make_gl_renderer(scene, {0, samples}, model);
  return test::render(*renderer, model, camera);
}

/// Calls f(pixel's irradiance, point of the world, direction to the camera) for each pixel that sees the surface.
template <typename Function>
void for_each_seen(const Sample& sample, const Camera& model, const Kinematics& camera, const Function& f) {
  int count = 0;
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      if (!std::isfinite(sample.depth(x, y))) continue;
      const Vector3d bearing = model.back_project(Eigen::Vector2d(x, y))->bearing;
      const Vector3d point = camera.T_world_body * (double{sample.depth(x, y)} * bearing);
      f(double{sample.irradiance(x, y)}, point, (camera.T_world_body.translation - point).normalized());
      ++count;
    }
  }
  ASSERT_GT(count, 100);
}

std::vector<Reference> surfaces() {
  std::vector<Reference> all;
  for (const double metallic : {0.0, 0.4, 1.0}) {
    for (const double roughness : {0.1, 0.3, 0.6, 1.0}) all.push_back({0.7, metallic, roughness});
  }
  all.push_back({0.2, 0, 0.4, 0.16, 0.8});
  all.push_back({0, 0, 0.2});
  return all;
}

class Glossy : public testing::TestWithParam<Engine> {
 protected:
  void SetUp() override {
    if (GetParam() == Engine::gl && !test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  }
};

std::string name_of(const testing::TestParamInfo<Engine>& test) {
  return test.param == Engine::raycast ? "raycast" : test.param == Engine::raster ? "raster" : "gl";
}

INSTANTIATE_TEST_SUITE_P(All, Glossy, testing::ValuesIn(kEngines), name_of);

TEST_P(Glossy, ReflectsSunsAndLampsByTheEquations) {
  const Kinematics camera = looking({1.2, -1.5, 1.1}, {0.1, 0.2, 0});
  const Vector3d lamp(-0.6, 1.1, 0.9), sun(0.6, -0.9, -0.7);
  for (const Reference& surface : surfaces()) {
    Lighting lighting = glossy();
    lighting.suns.push_back({sun.cast<float>(), 0.8F});
    lighting.points.push_back({lamp.cast<float>(), 1.5F});
    const Sample sample = seen(square(shining(surface)), lighting, camera, GetParam());
    for_each_seen(sample, kModel, camera, [&](double irradiance, const Vector3d& point, const Vector3d& v) {
      const auto reflected = [&](const Vector3d& p) {
        const Vector3d n = Vector3d::UnitZ(), to_lamp = lamp - p, l = to_lamp.normalized(), s = -sun.normalized();
        const Vector3d to_camera = (camera.T_world_body.translation - p).normalized();
        return 0.8 * n.dot(s) * surface.reflectance(n, s, to_camera) +
               1.5 / to_lamp.squaredNorm() * n.dot(l) * surface.reflectance(n, l, to_camera);
      };
      const double expected = reflected(point);
      // Sharp highlights depend on the last digits of the point.
      double tolerance = 2e-4 * expected / std::pow(surface.roughness, 2) * 0.1 + 1e-4 * expected;
      if (GetParam() == Engine::gl) {
        // Graphics cards round vertices to 1/256 of a pixel (GL_SUBPIXEL_BITS), which moves the points between three of
        // them by 1/1500 rms. An NVIDIA H200 needs a tenth more than the tolerance of the other engines.
        const double step = (camera.T_world_body.translation - point).norm() / kModel.fx / v.z() / 1024;
        for (const Vector3d& side : {Vector3d(step, 0, 0), Vector3d(0, step, 0)})
          tolerance += std::abs(reflected(point + side) - reflected(point - side)) / 2;
      }
      ASSERT_NEAR(irradiance, expected, tolerance) << surface.metallic << ", " << surface.roughness;
    });
  }
}

TEST_P(Glossy, AreaLightsAreTheMeanOfTheirPoints) {
  // A rough surface, so that its points suffice: against many more points of the reference.
  const Kinematics camera = looking({1.2, -1.5, 1.1}, {0.1, 0.2, 0});
  const Reference surface{0.6, 0.5, 0.7};
  AreaLight area;
  area.position = {-0.3F, 0.6F, 1.1F}, area.half_u = {0.2F, 0, 0}, area.half_v = {0, 0.15F, 0.15F};
  area.direction = Eigen::Vector3f(0, 1, -1).normalized(), area.strength = 2, area.samples = 12;
  Lighting lighting = glossy();
  lighting.areas.push_back(area);
  const Sample sample = seen(square(shining(surface)), lighting, camera, GetParam());
  int lit = 0;
  for_each_seen(sample, kModel, camera, [&](double irradiance, const Vector3d& point, const Vector3d& v) {
    constexpr int kFine = 40;
    double expected = 0;
    for (int k = 0; k < kFine * kFine; ++k) {
      const double s = 2 * (k % kFine + 0.5) / kFine - 1, t = 2 * (k / kFine + 0.5) / kFine - 1;
      const Vector3d to =
          area.position.cast<double>() + s * area.half_u.cast<double>() + t * area.half_v.cast<double>() - point;
      const Vector3d l = to.normalized(), n = Vector3d::UnitZ();
      const double leaves = std::max(-area.direction.cast<double>().dot(l), 0.0);
      expected += 2.0 / (kFine * kFine) * leaves / to.squaredNorm() * n.dot(l) * surface.reflectance(n, l, v);
    }
    ASSERT_NEAR(irradiance, expected, 0.01 * expected + 2e-3);
    lit += expected > 0.05;
  });
  EXPECT_GT(lit, 100);
}

TEST(GlossySurfaces, AreReciprocal) {
  const Vector3d a(0.9, 0.4, 0.8), b(-0.5, 1.1, 0.6);
  const Camera model{1, 1, 100, 100, 0, 0, NoDistortion{}};
  for (const Reference& surface : surfaces()) {
    const auto through = [&](const Vector3d& from, const Vector3d& lamp) {
      Lighting lighting = glossy();
      lighting.points.push_back({lamp.cast<float>(), 1});
      const double seen_there = double{
          seen(square(shining(surface)), lighting, looking(from, {0, 0, 0}), Engine::raycast, model).irradiance(0, 0)};
      return seen_there * lamp.squaredNorm() / lamp.normalized().z();
    };
    EXPECT_NEAR(through(a, b), through(b, a), 1e-4 * through(a, b));
  }
}

/// Light of radiance 1 from everywhere, by many suns.
Lighting furnace() {
  constexpr int kSuns = 20000;
  Lighting lighting = glossy();
  for (int i = 0; i < kSuns; ++i) {
    const double z = 1 - (2 * i + 1.0) / kSuns, longitude = i * kPi * (3 - std::sqrt(5.0)), rho = std::sqrt(1 - z * z);
    lighting.suns.push_back(
        {Eigen::Vector3d(rho * std::cos(longitude), rho * std::sin(longitude), z).cast<float>(), 4.0F / kSuns});
  }
  return lighting;
}

TEST(GlossySurfaces, ReflectNoMoreThanTheyReceive) {
  const Camera model{1, 1, 100, 100, 0, 0, NoDistortion{}};
  const Lighting lighting = furnace();
  Lighting ambient = glossy();
  ambient.ambient = 1;
  for (const double roughness : {0.3, 0.6, 1.0}) {
    for (const double z : {0.2, 0.7, 3.0}) {
      const Kinematics camera = looking({1, 0, z}, {0, 0, 0});
      const auto look = [&](const Reference& surface, const Lighting& light) {
        return double{seen(square(shining(surface)), light, camera, Engine::raycast, model).irradiance(0, 0)};
      };
      const Reference metal{1, 1, roughness}, black{0, 0, roughness}, white{1, 0, roughness};
      for (const Reference& surface : {metal, black}) {
        EXPECT_LT(look(surface, lighting), 1.002) << roughness << ", " << z;
        // The table is the same integral.
        EXPECT_NEAR(look(surface, ambient), look(surface, lighting), 0.005) << roughness << ", " << z;
      }
      // White below a dielectric layer: the equations of glTF 2.0 themselves reflect more than they receive at grazing
      // angles. Light from everywhere is divided exactly.
      EXPECT_LT(look(white, lighting), z < 0.5 ? 1.25 : 1.02) << roughness << ", " << z;
      EXPECT_NEAR(look(white, ambient), 1, 1e-5);
    }
  }
}

TEST(GlossySurfaces, AMirrorShowsALampWhereItsMirrorImageIs) {
  const Kinematics camera = looking({0.3, -1.5, 1.1}, {0, 0, 0});
  const Vector3d lamp(0.2, 0.7, 0.8);
  Lighting lighting = glossy();
  lighting.points.push_back({lamp.cast<float>(), 1});
  const Camera model = Camera::from_fov(240, 180, 0.8);
  for (const Engine engine : {Engine::raycast, Engine::raster}) {
    const Sample sample = seen(square(shining({0.5, 1, 0.05})), lighting, camera, engine, model, 16);
    const auto pixels = sample.irradiance.pixels();
    const auto brightest = static_cast<int>(std::max_element(pixels.begin(), pixels.end()) - pixels.begin());
    const auto image = model.project(camera.T_world_body.inverse() * Vector3d(lamp.x(), lamp.y(), -lamp.z()));
    ASSERT_TRUE(image);
    EXPECT_NEAR(brightest % model.width, image->pixel.x(), 1.0);
    EXPECT_NEAR(brightest / model.width, image->pixel.y(), 1.0);
  }
}

// --- normal maps -----------------------------------------------------------------------------------------------------

TEST(TextureFrame, IsThatOfFiniteDifferences) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, 1);
  const auto vector = [&] { return Eigen::Vector3f(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 200; ++i) {
    // A triangle whose texture coordinates are an affine function of the position in its plane.
    const Eigen::Vector3f e1 = vector(), e2 = vector(), g = e1.cross(e2).normalized();
    const Eigen::Vector2f uv1(normal(random), normal(random)), uv2(normal(random), normal(random));
    Eigen::Matrix3f edges;
    edges << e1.transpose(), e2.transpose(), g.transpose();
    const Eigen::Vector3f gu = edges.inverse() * Eigen::Vector3f(uv1.x(), uv2.x(), 0);
    const Eigen::Vector3f gv = edges.inverse() * Eigen::Vector3f(uv1.y(), uv2.y(), 0);
    Eigen::Vector3f t, b;
    ASSERT_TRUE(texture_frame(gu, gv, g, g, t, b));
    // Along t, u increases and v is constant; along b, v decreases.
    EXPECT_NEAR(gv.dot(t), 0, 1e-4F * gv.norm());
    EXPECT_GT(gu.dot(t), 0);
    EXPECT_LT(gv.dot(b), 0);
    EXPECT_NEAR(t.dot(b), 0, 1e-5F);
    EXPECT_NEAR(t.norm(), 1, 1e-5F);
    EXPECT_NEAR(b.norm(), 1, 1e-5F);
    // With another normal, both are perpendicular to it, on either side of the surface.
    const Eigen::Vector3f n = (g + 0.3F * vector()).normalized();
    Eigen::Vector3f t2, b2, t3, b3;
    ASSERT_TRUE(texture_frame(gu, gv, g, n, t2, b2) && texture_frame(gu, gv, -g, -n, t3, b3));
    EXPECT_NEAR(t2.dot(n), 0, 1e-5F);
    EXPECT_NEAR(b2.dot(n), 0, 1e-5F);
    EXPECT_LT((t2 - t3).norm() + (b2 - b3).norm(), 1e-4F);
  }
  Eigen::Vector3f t, b;
  EXPECT_FALSE(texture_frame(Eigen::Vector3f::UnitX(), 2 * Eigen::Vector3f::UnitX(), Eigen::Vector3f::UnitZ(),
                             Eigen::Vector3f::UnitZ(), t, b));
}

/// A material whose normal map has normals that alternate along u between two, in cells of one texel.
Material embossed(const Reference& surface, const Eigen::Vector3f& one, const Eigen::Vector3f& other) {
  Material material = shining(surface);
  Gloss gloss = *material.gloss;
  for (int c = 0; c < 3; ++c) {
    Image<float> image(256, 4);
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 256; ++x) image(x, y) = 0.5F + 0.5F * (x % 2 == 0 ? one : other)[c];
    }
    gloss.normal_textures[static_cast<std::size_t>(c)] =
        std::make_shared<const Texture>(image, Wrap::repeat, Wrap::repeat);
  }
  material.gloss = std::make_shared<const Gloss>(gloss);
  return material;
}

TEST_P(Glossy, ReliefTurnsTheNormal) {
  const Eigen::Vector3f bent = Eigen::Vector3f(0.3F, 0.2F, 1).normalized();
  const Vector3d sun(0.3, -0.5, -1);
  Lighting lighting = glossy();
  lighting.suns.push_back({sun.cast<float>(), 1});
  for (const bool mirrored : {false, true}) {
    for (const bool behind : {false, true}) {
      const Kinematics camera = looking({0.5, -0.8, behind ? -1.4 : 1.4}, {0, 0, 0});
      const Reference surface{0.6, 0.3, 0.6};
      Mesh mesh = square(embossed(surface, bent, bent));
      if (mirrored) {
        for (auto& triangle : mesh.texture_uv) {
          for (Eigen::Vector2f& uv : triangle) uv.x() = -uv.x();
        }
      }
      lighting.suns[0].direction.z() = behind ? 1 : -1;
      const Sample sample = seen(mesh, lighting, camera, GetParam());
      // u is along x and v against y, so that the relief's y is along y. From behind, all of the normal is reversed.
      const Vector3d front(mirrored ? -bent.x() : bent.x(), bent.y(), bent.z());
      const Vector3d n = behind ? Vector3d(-front) : front, l = -lighting.suns[0].direction.cast<double>().normalized();
      for_each_seen(sample, kModel, camera, [&](double irradiance, const Vector3d&, const Vector3d& v) {
        const double expected = n.dot(l) * surface.reflectance(n, l, v);
        ASSERT_NEAR(irradiance, expected, 3e-3 * expected) << mirrored << behind;
      });
    }
  }
}

TEST_P(Glossy, ReliefBelowAPixelWidensTheLobe) {
  // Slopes of +-0.2 along x, each far smaller than a pixel.
  const Eigen::Vector3f one = Eigen::Vector3f(0.2F, 0, 1).normalized(), other(-one.x(), 0, one.z());
  const Kinematics camera = looking({0.5, -2.8, 2.4}, {0, 0, 0});
  Lighting lighting = glossy();
  lighting.suns.push_back({{0.1F, 1, -1}, 1});
  Reference surface{0.6, 1, 0.3};
  Mesh mesh = square(embossed(surface, one, other));
  for (auto& triangle : mesh.texture_uv) {
    for (Eigen::Vector2f& uv : triangle) uv *= 20;
  }
  const Sample sample = seen(mesh, lighting, camera, GetParam(), Camera::from_fov(48, 36, 0.5), 1);
  const double length = double{one.z()};
  surface.widening = 2 * (1 - length) / length;
  const Vector3d n = Vector3d::UnitZ(), l = Vector3d(-0.1, -1, 1).normalized();
  for_each_seen(sample, Camera::from_fov(48, 36, 0.5), camera,
                [&](double irradiance, const Vector3d&, const Vector3d& v) {
                  const double expected = n.dot(l) * surface.reflectance(n, l, v);
                  ASSERT_NEAR(irradiance, expected, 0.03 * expected);
                });
}

// --- the engines -----------------------------------------------------------------------------------------------------

/// A ball of a few materials on a floor, under every light.
Scene still_life(bool shadows, bool areas) {
  Scene scene = still_scene(square(shining({0.5, 0, 0.3})));
  Mesh ball = test::ball_mesh(0.5F, 48);
  for (Eigen::Vector3f& vertex : ball.vertices) vertex.z() += 0.55F;
  ball.materials = {shining({0.8, 1, 0.4})};
  scene.objects.push_back({"ball", ball});
  Lighting lighting = glossy();
  lighting.shadows = shadows;
  lighting.suns.push_back({{0.5F, 0.7F, -1}, 0.5F});
  lighting.points.push_back({{-1, -1, 2}, 2});
  if (areas) {
    AreaLight area;
    area.position = {0.6F, -0.4F, 1.9F}, area.strength = 2, area.samples = 8;
    lighting.areas.push_back(area);
  }
  lighting.environment = std::make_shared<const Environment>(Planes{test::smooth_sky(128)}, 0.6F, 0.5, "sky");
  lighting.environment_visible = true;
  scene.lighting = lighting;
  return scene;
}

/// The mean absolute difference of E, and the fraction of the pixels in which it is above a limit.
struct Agreement {
  double mean = 0, different = 0;
};

Agreement agreement(const Sample& a, const Sample& b, double limit) {
  Agreement found;
  const std::size_t count = a.irradiance.size();
  for (std::size_t k = 0; k < count; ++k) {
    const double off = std::fabs(double{a.irradiance.data()[k]} - double{b.irradiance.data()[k]});
    found.mean += off / static_cast<double>(count);
    found.different += (off > limit ? 1.0 : 0.0) / static_cast<double>(count);
  }
  return found;
}

TEST(GlossySurfaces, EnginesAgree) {
  const Camera model = Camera::from_fov(160, 120, 1.0);
  const Kinematics camera = looking({1.4, -1.9, 1.0}, {0, 0, 0.4});
  for (const bool shadows : {false, true}) {
    const Scene scene = still_life(shadows, true);
    const Sample cast = test::render(
        *make_raycast_renderer(build_raycast_scene(scene), {0, 64}, model, test::two_threads()), model, camera);
    const Sample drawn = test::render(
        *make_raster_renderer(build_raster_scene(scene), {0, 64}, model, test::two_threads()), model, camera);
    const Agreement found = agreement(cast, drawn, 0.03);
    EXPECT_LT(found.mean, 1e-3) << shadows;
    EXPECT_LT(found.different, 1.0 / 500) << "edges of shadows only; " << shadows;
  }
}

TEST(GlossySurfaces, GlAgreesWithRays) {
  if (!test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  const Camera model = Camera::from_fov(160, 120, 1.0);
  const Kinematics camera = looking({1.4, -1.9, 1.0}, {0, 0, 0.4});
  for (const bool shadows : {false, true}) {
    const Scene scene = still_life(shadows, !shadows);
    const Sample cast = test::render(
        *make_raycast_renderer(build_raycast_scene(scene), {0, 1}, model, test::two_threads()), model, camera);
    const Sample gl = test::render(*make_gl_renderer(scene, {0, 1}, model), model, camera);
    const Agreement found = agreement(cast, gl, 0.01);
    EXPECT_LT(found.mean, 3e-3) << shadows;
    EXPECT_LT(found.different, 1.0 / 50) << "outlines and edges of shadows only";
  }
}

TEST(GlossySurfaces, GlRefusesShadowsThatItCannotDraw) {
  if (!test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  EXPECT_THROW(make_gl_renderer(still_life(true, true), {}, kModel), UserError);
  Scene scene = test::glossy_moving_scene();
  scene.lighting->areas.clear();
  scene.lighting->shadows = true;
  EXPECT_THROW(make_gl_renderer(scene, {}, kModel), UserError);
}

TEST_P(Glossy, TheSkyIsBehindTheSurfaces) {
  const Environment& sky = *still_life(false, false).lighting->environment;
  Scene scene = still_life(false, false);
  const Kinematics camera = looking({0, 0, 1}, {1, 0.4, 1.5});
  const Sample sample = seen(scene.objects[0].mesh, *scene.lighting, camera, GetParam());
  int behind = 0;
  for (int y = 0; y < kModel.height; ++y) {
    for (int x = 0; x < kModel.width; ++x) {
      if (std::isfinite(sample.depth(x, y))) continue;
      const Vector3d d = camera.T_world_body.rotation * kModel.back_project(Eigen::Vector2d(x, y))->bearing;
      const Eigen::Vector3f f = d.cast<float>();
      ASSERT_NEAR(sample.irradiance(x, y), sky.specular(0, f.x(), f.y(), f.z(), 0), 0.01) << x << ", " << y;
      ++behind;
    }
  }
  EXPECT_GT(behind, 500);
}

// --- lights that change ----------------------------------------------------------------------------------------------

TEST(StrengthCurves, AreLinearBetweenTheirPoints) {
  const StrengthCurve curve{{{1, 0.5F}, {2, 2}, {2, 0}, {4, 1}}};
  for (const auto& [t_s, factor] : {std::pair{0.0, 0.5}, {1.0, 0.5}, {1.5, 1.25}, {2.0, 0.0}, {3.0, 0.5}, {9.0, 1.0}})
    EXPECT_NEAR(curve.at(to_ns(t_s)), factor, 1e-6) << t_s;
  EXPECT_NEAR(curve.at(to_ns(1.999999)), 2, 1e-5);
  EXPECT_EQ(StrengthCurve().at(5), 1);
}

TEST_P(Glossy, LightsFollowTheirObjectsAndCurves) {
  Scene scene = still_scene(square(shining({0.5, 0, 0.5})));
  Mesh small = test::ball_mesh(0.05F, 4);
  scene.objects.push_back({"carrier", small, true});
  scene.lighting = glossy();
  PointLight lamp{{0.5F, 0, 0}, 1, {{{0, 0}, {2, 2}}}, 0};
  AreaLight area;
  area.position = {0, 0.4F, 0}, area.object = 0, area.curve = {{{0, 1}, {1, 3}}};
  scene.lighting->points.push_back(lamp), scene.lighting->areas.push_back(area);
  Kinematics object;
  object.T_world_body = {so3_exp(Vector3d(0.1, -0.3, 1.2)), {0.2, 0.3, 0.9}};

  // The same lights, placed by hand at 0.5 s.
  Scene fixed = scene;
  const Eigen::Matrix3f R = object.T_world_body.rotation.toRotationMatrix().cast<float>();
  const auto placed = [&](const Eigen::Vector3f& p) {
    return Eigen::Vector3f((object.T_world_body * p.cast<double>()).cast<float>());
  };
  fixed.lighting->points[0] = {placed(lamp.position), 0.5F};
  AreaLight& here = fixed.lighting->areas[0];
  here = AreaLight{placed(area.position), R * area.half_u, R * area.half_v, R * area.direction, 2};
  const auto render = [&](const Scene& of) {
    const auto renderer = GetParam() == Engine::raycast
                              ? make_raycast_renderer(build_raycast_scene(of), {0, 1}, kModel, test::two_threads())
                          : GetParam() == Engine::raster
                              ? make_raster_renderer(build_raster_scene(of), {0, 1}, kModel, test::two_threads())
                              : make_gl_renderer(of, {0, 1}, kModel);
    Sample sample;
    renderer->render({to_ns(0.5), looking({1, -1.5, 1.4}, {0, 0, 0}), {{0, 0, kModel.width, kModel.height}}, {object}},
                     sample);
    return sample;
  };
  const Sample moving = render(scene), still = render(fixed);
  double brightest = 0;
  for (std::size_t k = 0; k < moving.irradiance.size(); ++k) {
    ASSERT_NEAR(moving.irradiance.data()[k], still.irradiance.data()[k], 1e-4 * (1 + still.irradiance.data()[k]));
    brightest = std::max(brightest, double{moving.irradiance.data()[k]});
  }
  EXPECT_GT(brightest, 0.2);
}

}  // namespace
}  // namespace esim
