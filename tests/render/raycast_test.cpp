// The ray caster against closed forms: depth, edges, moving objects, light and shadow.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include "esim/core/error.h"
#include "render/scenes.h"

namespace esim {
namespace {

TEST(RaycastRenderer, MeasuresPlanarDepth) {
  // The wall at x = 4, seen frontally from x = 1: depth 3 m in every pixel that sees it, at any distance from the axis.
  Kinematics camera;
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_world_body = {Eigen::Quaterniond(R), {1, 0, 0}};
  const Camera model = test::distorted_camera(0);
  const Sample sample = test::render(*test::make_renderer("mesh", model), model, camera);
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) EXPECT_NEAR(sample.depth(x, y), 3.0, 1e-5) << x << ", " << y;
  }
}

// --- edges ---------------------------------------------------------------------------------------------------------

/// A black half-plane at z = 1 over a white background: where u cos(a) + v sin(a) < offset, px from the image's centre.
Scene black_half_plane(double angle, double offset, const Camera& camera) {
  Mesh mesh;
  const Eigen::Vector2d normal(std::cos(angle), std::sin(angle)), along(-normal.y(), normal.x());
  for (const auto& [n, s] : {std::pair{offset, -1e4}, {offset, 1e4}, {-1e4, 0.0}}) {
    const Eigen::Vector2d at = n * normal + s * along;
    mesh.vertices.emplace_back(static_cast<float>(at.x() / camera.fx), static_cast<float>(at.y() / camera.fy), 1.0F);
  }
  mesh.triangles = {{0, 1, 2}};
  mesh.texture_uv.resize(1);
  mesh.material = {0};
  mesh.materials = {{"black", nullptr, 0.0F}};
  return still_scene(mesh);
}

Sample half_plane_seen(double angle, double offset, int rays) {
  const Camera model = test::distorted_camera(0);
  const auto renderer = make_raycast_renderer(build_raycast_scene(black_half_plane(angle, offset, model)), {1.0F, rays},
                                              model, test::two_threads());
  return test::render(*renderer, model, Kinematics{});
}

/// The fraction of a pixel that the half-plane leaves white, by a fine grid.
double white_fraction(double x, double y, double angle, double offset) {
  constexpr int kGrid = 40;
  int white = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const double u = x + (i % kGrid + 0.5) / kGrid - 0.5, v = y + (i / kGrid + 0.5) / kGrid - 0.5;
    white += u * std::cos(angle) + v * std::sin(angle) >= offset;
  }
  return static_cast<double>(white) / (kGrid * kGrid);
}

TEST(RaycastRenderer, APixelOnAnEdgeIsTheMeanOverItsArea) {
  const Camera model = test::distorted_camera(0);
  for (const auto& [rays, typical, worst] : {std::tuple{16, 0.05, 2.0 / 16}, {64, 0.0125, 3.0 / 64}}) {
    for (const double angle : {0.0, 0.3, 0.8, std::numbers::pi / 2, 2.0}) {
      const double offset = 1.37;
      const Sample sample = half_plane_seen(angle, offset, rays);
      double squares = 0;
      int between = 0;
      for (int y = 0; y < model.height; ++y) {
        for (int x = 0; x < model.width; ++x) {
          const double expected = white_fraction(x - model.cx, y - model.cy, angle, offset);
          const double error = sample.irradiance(x, y) - expected;
          EXPECT_NEAR(error, 0, worst) << x << ", " << y << " at " << angle;
          if (expected > 0.01 && expected < 0.99) squares += error * error, ++between;
        }
      }
      ASSERT_GT(between, 50);
      EXPECT_LT(std::sqrt(squares / between), typical);
    }
  }
}

TEST(RaycastRenderer, AnEdgeThatMovesComesInSmallSteps) {
  for (const auto& [rays, steps] : {std::pair{1, 1}, {16, 16}, {64, 64}}) {
    for (const double angle : {0.0, std::numbers::pi / 2, 0.6}) {
      Sample before;
      float largest = 0;
      for (int i = 0; i <= 100; ++i) {
        Sample now = half_plane_seen(angle, 0.4 + 0.01 * i, rays);
        for (std::size_t k = 0; k < now.irradiance.size() && i > 0; ++k) {
          largest = std::max(largest, std::fabs(now.irradiance.data()[k] - before.irradiance.data()[k]));
        }
        before = std::move(now);
      }
      EXPECT_GT(largest, 0.9 / steps);
      EXPECT_LT(largest, 2.1 / steps) << "one ray or two at a time";
    }
  }
}

TEST(RaycastRenderer, SeamsBetweenTrianglesOfOneSurfaceAreNoEdges) {
  // A finely tessellated ball with a texture: away from the outline, more rays must not change anything.
  Scene scene = still_scene(test::ball_mesh(3, 60));
  const Camera model = test::distorted_camera(1);
  const auto shared = build_raycast_scene(scene);
  const auto seen = [&](int rays) {
    return test::render(*make_raycast_renderer(shared, {1.0F, rays}, model, test::two_threads()), model, Kinematics{});
  };
  const Sample one = seen(1), many = seen(16);
  for (std::size_t k = 0; k < one.irradiance.size(); ++k) {
    ASSERT_EQ(one.irradiance.data()[k], many.irradiance.data()[k]) << k;
  }
}

TEST(RaycastRenderer, SurfacesAreNoSharperWhereAnEdgeIs) {
  // A wall of noise, cut into stripes of two materials that look the same: their seams are edges, but invisible.
  constexpr int kTexels = 256, kStripes = 40;
  Image<float> noise(kTexels, kTexels);
  std::mt19937 random(1);
  for (float& value : noise.pixels()) value = std::uniform_real_distribution<float>(0, 1)(random);
  const auto texture = std::make_shared<const Texture>(noise, Wrap::repeat, Wrap::repeat);
  const Camera model = test::distorted_camera(0);
  const float size = 0.6F * static_cast<float>(kTexels / model.fx);  // at 1 m: texels of 0.6 px
  Mesh mesh;
  mesh.materials = {{"odd", texture, 1.0F}, {"even", texture, 1.0F}};
  for (int i = 0; i < kStripes; ++i) {
    const float u0 = static_cast<float>(i) / kStripes, u1 = static_cast<float>(i + 1) / kStripes;
    const auto corner = [&](float u, float v) { return Eigen::Vector3f((u - 0.5F) * size, (v - 0.5F) * size, 1); };
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& [u, v] : {std::pair{u0, 0.0F}, {u1, 0.0F}, {u1, 1.0F}, {u0, 1.0F}})
      mesh.vertices.push_back(corner(u, v));
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.texture_uv.push_back({Eigen::Vector2f(u0, 0), Eigen::Vector2f(u1, 0), Eigen::Vector2f(u1, 1)});
    mesh.texture_uv.push_back({Eigen::Vector2f(u0, 0), Eigen::Vector2f(u1, 1), Eigen::Vector2f(u0, 1)});
    mesh.material.insert(mesh.material.end(), 2, static_cast<std::uint32_t>(i % 2));
  }
  const auto shared = build_raycast_scene(still_scene(mesh));
  const auto seen = [&](int rays) {
    return test::render(*make_raycast_renderer(shared, {0.5F, rays}, model, test::two_threads()), model, Kinematics{});
  };
  const Sample one = seen(1), many = seen(16);
  double sum_one = 0, sum_many = 0, squares_one = 0, squares_many = 0;
  int crossed = 0;
  for (std::size_t k = 0; k < one.irradiance.size(); ++k) {
    const double a = one.irradiance.data()[k], b = many.irradiance.data()[k];
    if (a == b) continue;  // no edge there
    sum_one += a, sum_many += b, squares_one += a * a, squares_many += b * b, ++crossed;
  }
  ASSERT_GT(crossed, 300);
  const auto variance = [&](double sum, double squares) { return squares / crossed - sum * sum / crossed / crossed; };
  EXPECT_NEAR(variance(sum_many, squares_many) / variance(sum_one, squares_one), 1, 0.1);
}

TEST(RaycastRenderer, NarrowPixelsAverageToWideOnes) {
  constexpr int kWide = 3;
  const Camera model = test::distorted_camera(1);
  const auto scene = build_raycast_scene(test::plain_moving_scene());
  const auto see = [&](const PixelArea& area) {
    const auto renderer =
        make_raycast_renderer(scene, {0.5F, 64}, model, test::two_threads(), ColourFilters::none, area);
    Sample sample;
    renderer->render({test::kTime, test::moving_camera(), {{0, 0, model.width, model.height}}, test::moving_objects(0)},
                     sample);
    return sample;
  };
  const Sample wide = see({kWide, kWide}), narrow = see({kWide, 1});
  double squares = 0, unlike = 0;
  int count = 0;
  for (int y = 1; y + 1 < model.height; ++y) {
    for (int x = 1; x + 1 < model.width; ++x, ++count) {
      double mean = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) mean += narrow.irradiance(x + i, y + j) / (kWide * kWide);
      squares += std::pow(mean - wide.irradiance(x, y), 2);
      unlike += std::pow(narrow.irradiance(x, y) - wide.irradiance(x, y), 2);
      ASSERT_EQ(wide.depth(x, y), narrow.depth(x, y));
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.003);
  EXPECT_GT(std::sqrt(unlike / count), 0.015) << "edges should be narrower";
}

// --- moving objects
// ---------------------------------------------------------------------------------------------------

/// A square of 2 x 2 m in the plane z = 0 of its frame, of one base colour.
Mesh square_mesh(float base) {
  Mesh mesh;
  mesh.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.texture_uv.resize(2, {Eigen::Vector2f(0, 0), Eigen::Vector2f(0, 0), Eigen::Vector2f(0, 0)});
  mesh.material = {0, 0};
  mesh.materials = {{"plain", nullptr, base}};
  return mesh;
}

/// At rest, `distance` in front of a camera at the world's origin that looks along z.
Kinematics at_distance(double distance) {
  Kinematics pose;
  pose.T_world_body.translation = {0, 0, distance};
  return pose;
}

Sample render_scene(const Scene& scene, const std::vector<Kinematics>& objects, const Kinematics& camera = {}) {
  const Camera model = test::distorted_camera(0);
  const auto renderer = make_raycast_renderer(build_raycast_scene(scene), {}, model, test::two_threads());
  return test::render(*renderer, model, camera, objects);
}

TEST(RaycastRenderer, SeesTheNearestOfMovingObjects) {
  Scene scene;
  scene.objects = {{"a", square_mesh(0.25F), true}, {"b", square_mesh(0.5F), true}};
  for (const bool a_in_front : {true, false}) {
    const Sample sample = render_scene(scene, {at_distance(a_in_front ? 2 : 3), at_distance(a_in_front ? 3 : 2)});
    EXPECT_EQ(sample.object(60, 45), a_in_front ? 1 : 2);
    EXPECT_EQ(sample.irradiance(60, 45), a_in_front ? 0.25F : 0.5F);
    EXPECT_NEAR(sample.depth(60, 45), 2, 1e-5);
    EXPECT_EQ(sample.object(0, 0), 0);
    EXPECT_TRUE(std::isinf(sample.depth(0, 0)));
  }
}

TEST(RaycastRenderer, ShowsAMovingMeshAsTheSameMeshAtRestThere) {
  const Camera model = test::distorted_camera(1);
  Kinematics pose;
  pose.T_world_body = {so3_exp(Eigen::Vector3d(0.2, -0.4, 0.7)), {0.3, -0.2, 0.4}};
  Mesh placed = test::box_mesh();
  for (Eigen::Vector3f& vertex : placed.vertices) vertex = (pose.T_world_body * vertex.cast<double>()).cast<float>();
  Scene moving;
  moving.objects = {{"box", test::box_mesh(), true}};
  const auto render = [&](const Scene& scene, const std::vector<Kinematics>& objects) {
    return test::render(*make_raycast_renderer(build_raycast_scene(scene), {}, model, test::two_threads()), model,
                        test::moving_camera(), objects);
  };
  const Sample expected = render(still_scene(placed), {}), sample = render(moving, {pose});
  int differ = 0;
  for (std::size_t i = 0; i < sample.depth.size(); ++i) {
    ASSERT_NEAR(sample.depth.pixels()[i], expected.depth.pixels()[i], 1e-4);
    differ += std::fabs(sample.irradiance.pixels()[i] - expected.irradiance.pixels()[i]) > 2e-3F ? 1 : 0;
    ASSERT_NEAR(sample.motion_x.pixels()[i], expected.motion_x.pixels()[i], 0.05);
  }
  EXPECT_LT(differ, 20) << "but at the box's edges";
}

TEST(RaycastRenderer, StaysFiniteWhenAnObjectPassesThroughTheCamera) {
  Scene scene = still_scene(test::box_mesh());
  scene.objects.push_back({"square", square_mesh(0.5F), true});
  for (const double distance : {1e-2, 1e-4, 0.0, -1e-4, -1e-2}) {
    Kinematics square = at_distance(distance);
    square.velocity_world = {0.1, 0, -1};
    const Sample sample = render_scene(scene, {square});
    for (const float v : sample.motion_x.pixels()) ASSERT_TRUE(std::isfinite(v));
    for (const float z : sample.depth.pixels()) ASSERT_GT(z, 0.0F);
    EXPECT_EQ(sample.object(60, 45), distance > 5e-3 ? 1 : 0) << "in front of the lens or not";
  }
}

TEST(RaycastRenderer, RefusesTheWrongNumberOfObjects) {
  EXPECT_THROW(render_scene(test::moving_scene(), {}), InternalError);
  EXPECT_THROW(render_scene(still_scene(test::box_mesh()), {Kinematics{}}), InternalError);
}

TEST(RaycastRenderer, ShowsTheBackgroundOfAnEmptyScene) {
  const Sample sample = render_scene(Scene{}, {});
  for (const float value : sample.irradiance.pixels()) ASSERT_EQ(value, 0.2F);
}

// --- light ---------------------------------------------------------------------------------------------------------

/// A wall of albedo 0.5 at z = 2 m, as seen from the origin along z.
Scene lit_wall(const Lighting& lighting) {
  Mesh wall = square_mesh(0.5F);
  for (Eigen::Vector3f& vertex : wall.vertices) vertex = Eigen::Vector3f(10 * vertex.x(), 10 * vertex.y(), 2);
  Scene scene = still_scene(wall);
  scene.lighting = lighting;
  return scene;
}

Eigen::Vector3d point_seen(const Sample& sample, int x, int y) {
  return double{sample.depth(x, y)} * test::distorted_camera(0).back_project(Eigen::Vector2d(x, y))->bearing;
}

TEST(Light, OfASunGoesWithTheCosine) {
  for (const double angle : {0.0, 0.4, 1.2, 1.6, 3.0}) {
    Lighting lighting;
    lighting.ambient = 0.1F;
    lighting.suns = {{3 * Eigen::Vector3d(std::sin(angle), 0, std::cos(angle)).cast<float>(), 40.0F}};
    const Sample sample = render_scene(lit_wall(lighting), {});
    const double expected = 0.5 * (0.1 + 40.0 * std::max(0.0, std::cos(angle)));
    for (const float value : sample.irradiance.pixels()) ASSERT_NEAR(value, expected, 1e-4 * expected);
  }
}

TEST(Light, OfAPointFallsWithTheSquaredDistance) {
  Lighting lighting;
  lighting.points = {{{0.3F, -0.2F, 0.9F}, 5.0F}};
  const Sample sample = render_scene(lit_wall(lighting), {});
  for (int y = 0; y < sample.depth.height(); y += 5) {
    for (int x = 0; x < sample.depth.width(); x += 5) {
      const Eigen::Vector3d to_light = lighting.points[0].position.cast<double>() - point_seen(sample, x, y);
      const double expected = 0.5 * 5.0 * 1.1 / std::pow(to_light.norm(), 3);  // 1.1 m in front of the wall
      ASSERT_NEAR(sample.irradiance(x, y), expected, 1e-4 * expected) << x << ", " << y;
    }
  }
}

TEST(Light, AddsEmissionAndSparesUnlitMaterials) {
  Lighting lighting;
  lighting.ambient = 0.5F;
  Scene scene = lit_wall(lighting);
  Material& material = scene.objects[0].mesh.materials[0];
  material.emission = 7;
  EXPECT_NEAR(render_scene(scene, {}).irradiance(60, 45), 0.5 * 0.5 + 7, 1e-5);
  material.unlit = true;
  EXPECT_NEAR(render_scene(scene, {}).irradiance(60, 45), 0.5 + 7, 1e-5);
  scene.lighting.reset();
  material.unlit = false;
  EXPECT_NEAR(render_scene(scene, {}).irradiance(60, 45), 0.5 + 7, 1e-5);
}

TEST(Light, StopsAtAnObjectWhereGeometrySays) {
  // A square between a lamp and the wall, outside the view: its shadow is the square as seen from the lamp.
  for (const bool moves : {false, true}) {
    Lighting lighting;
    lighting.shadows = true;
    lighting.points = {{{0, 0, -2}, 8.0F}};
    Scene scene = lit_wall(lighting);
    Mesh square = square_mesh(0.5F);
    const double distance = -1;  // behind the camera; the shadow is four times as large
    for (Eigen::Vector3f& vertex : square.vertices) vertex *= 0.1F;
    if (!moves) {
      for (Eigen::Vector3f& vertex : square.vertices) vertex.z() += static_cast<float>(distance);
    }
    scene.objects.push_back({"square", square, moves});
    const Sample sample = render_scene(scene, moves ? std::vector{at_distance(distance)} : std::vector<Kinematics>());
    std::map<bool, int> pixels;
    for (int y = 0; y < sample.depth.height(); ++y) {
      for (int x = 0; x < sample.depth.width(); ++x) {
        const Eigen::Vector3d point = point_seen(sample, x, y);
        const double reach = std::max(std::fabs(point.x()), std::fabs(point.y()));
        if (std::fabs(reach - 0.4) < 1e-4) continue;
        const bool in_shadow = reach < 0.4;
        ++pixels[in_shadow];
        const double expected = in_shadow ? 0 : 0.5 * 8.0 * 4 / std::pow((point - Eigen::Vector3d(0, 0, -2)).norm(), 3);
        ASSERT_NEAR(sample.irradiance(x, y), expected, 1e-4) << x << ", " << y;
      }
    }
    EXPECT_GT(pixels[true], 300);
    EXPECT_GT(pixels[false], 1000);
  }
}

TEST(Light, ShadowsOfStraightEdgesAreSmooth) {
  // A shadow on a wall of one surface: 16 rays give the mean of a pixel, one ray gives full light or none.
  Lighting lighting;
  lighting.suns = {{{0.5F, 0.3F, 1}, 1.0F}};
  lighting.shadows = true;
  Scene scene = lit_wall(lighting);
  Mesh square = square_mesh(0.5F);  // of the wall's colour, in full light
  for (Eigen::Vector3f& vertex : square.vertices) vertex = 0.1F * vertex + Eigen::Vector3f(0.0123F, 0.0071F, 1);
  scene.objects.push_back({"square", square, false});
  const Camera model = test::distorted_camera(0);
  std::map<int, int> between;
  std::map<int, double> mean;
  for (const int rays : {1, 16}) {
    const auto renderer = make_raycast_renderer(build_raycast_scene(scene), {0, rays}, model, test::two_threads());
    const Sample sample = test::render(*renderer, model, Kinematics{});
    for (const float value : sample.irradiance.pixels()) {
      between[rays] += value > 0.02F && value < 0.4F;
      mean[rays] += value / static_cast<double>(sample.irradiance.size());
    }
  }
  EXPECT_EQ(between[1], 0);
  EXPECT_GT(between[16], 20);
  EXPECT_NEAR(mean[1], mean[16], 0.01);
}

TEST(Light, MakesNoEdgesOnWhatItDoesNotFallOn) {
  Lighting lighting;
  lighting.suns = {{{0, 0, 1}, 0.3F}};
  lighting.shadows = true;
  Scene scene = lit_wall(lighting);
  Mesh& wall = scene.objects[0].mesh;
  const Eigen::Vector2f a(0, 0), b(9, 0), c(9, 9), d(0, 9);
  wall.texture_uv = {{a, b, c}, {a, c, d}};
  wall.materials[0] = {"screen", test::smooth_texture(Wrap::repeat, Wrap::repeat), 1.0F};
  wall.materials[0].unlit = true;
  const Camera model = test::distorted_camera(0);
  const auto seen = [&](int rays) {
    const auto renderer = make_raycast_renderer(build_raycast_scene(scene), {0, rays}, model, test::two_threads());
    const Sample sample = test::render(*renderer, model, Kinematics{});
    return std::vector<float>(sample.irradiance.pixels().begin(), sample.irradiance.pixels().end());
  };
  EXPECT_EQ(seen(1), seen(16));
}

TEST(Light, LeavesNoShadowOfASurfaceOnItself) {
  // Inside a ball with a lamp in the middle, at many scales: no triangle shadows itself or its neighbours.
  for (const float radius : {0.1F, 3.0F, 1000.0F}) {
    Scene scene = still_scene(test::ball_mesh(radius, 20));
    scene.lighting = Lighting{0, {}, {{Eigen::Vector3f::Zero(), radius * radius}}, true};
    Kinematics camera;
    camera.T_world_body.translation = {0.2 * radius, -0.1 * radius, -0.3 * radius};
    const Sample sample = render_scene(scene, {}, camera);
    for (const float value : sample.irradiance.pixels()) ASSERT_NEAR(value, 1.0, 0.1);
  }
}

TEST(Light, FollowsTheNormalsOfAMesh) {
  // A coarse ball from outside, with the normals of a true sphere: the error of Lambert's cosine is small everywhere.
  const float radius = 0.5F;
  Scene scene;
  scene.objects = {{"ball", test::ball_mesh(radius, 10), true}};
  scene.lighting = Lighting{0, {{{0.3F, 0.5F, 0.8F}, 1.0F}}, {}, false};
  Kinematics pose = at_distance(2);
  pose.T_world_body.rotation = so3_exp(Eigen::Vector3d(1, 2, 0.5));
  const auto worst = [&] {
    const Sample sample = render_scene(scene, {pose});
    double error = 0;
    for (int y = 0; y < sample.depth.height(); ++y) {
      for (int x = 0; x < sample.depth.width(); ++x) {
        if (sample.object(x, y) == 0) continue;
        const Eigen::Vector3d n = (point_seen(sample, x, y) - pose.T_world_body.translation).normalized();
        if (n.z() > -0.3) continue;  // the rim
        const double expected = std::max(0.0, -n.dot(Eigen::Vector3d(0.3, 0.5, 0.8).normalized()));
        error = std::max(error, std::fabs(sample.irradiance(x, y) - expected));
      }
    }
    return error;
  };
  EXPECT_LT(worst(), 0.02);
  scene.objects[0].mesh.normals.clear();
  EXPECT_GT(worst(), 0.05) << "flat triangles";
}

TEST(Light, IsTheSameForAnyTilesAndThreads) {
  Scene scene = test::moving_scene();
  scene.lighting = Lighting{0.2F, {{{1, 0.2F, -1}, 1.0F}}, {{{0.5F, 0, 1}, 2.0F}}, true};
  const Camera model = test::distorted_camera(2);
  const Workers one(1);
  const auto shared = build_raycast_scene(scene);
  const auto a = make_raycast_renderer(shared, {0.2F, 16}, model, test::two_threads());
  const auto b = make_raycast_renderer(shared, {0.2F, 16}, model, one);
  const Sample whole = test::render(*a, model, test::moving_camera(), test::moving_objects(0));
  const Tile tile{13, 5, 50, 61};
  const Sample part = test::render(*b, model, test::moving_camera(), test::moving_objects(0), {tile});
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) ASSERT_EQ(part.irradiance(x, y), whole.irradiance(x, y));
  }
}

}  // namespace
}  // namespace esim
