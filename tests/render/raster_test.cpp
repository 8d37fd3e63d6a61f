// The rasteriser against areas in closed form, and against a slow search of all triangles at many points of each pixel.
#include "esim/backends/raycast/raster/raster_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "esim/backends/raycast/raster/clipped_triangles.h"
#include "esim/core/error.h"
#include "render/scenes.h"

namespace esim {
namespace {

Sample seen(const Scene& scene, const Camera& camera, int samples = 16, float background = 1.0F) {
  const auto renderer =
      make_raster_renderer(build_raster_scene(scene), {background, samples}, camera, test::two_threads());
  return test::render(*renderer, camera, Kinematics{});
}

/// Plain triangles, each with its own albedo.
Scene plain_scene(const std::vector<Eigen::Vector3f>& corners, const std::vector<float>& albedos) {
  Mesh mesh;
  mesh.vertices = corners;
  const Eigen::Vector2f origin(0, 0);
  for (std::uint32_t i = 0; i < albedos.size(); ++i) {
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    mesh.texture_uv.push_back({origin, origin, origin});
    mesh.material.push_back(static_cast<std::uint16_t>(i));
    mesh.materials.push_back({"plain", nullptr, albedos[i]});
  }
  return still_scene(mesh);
}

/// A black half-plane at z = 1 over a white background: where u cos(a) + v sin(a) < offset, px from the image's centre.
Scene black_half_plane(double angle, double offset, const Camera& camera) {
  std::vector<Eigen::Vector3f> corners;
  const Eigen::Vector2d normal(std::cos(angle), std::sin(angle)), along(-normal.y(), normal.x());
  for (const auto& [n, s] : {std::pair{offset, -1e3}, {offset, 1e3}, {-1e3, 0.0}}) {
    const Eigen::Vector2d at = n * normal + s * along;
    corners.emplace_back(static_cast<float>(at.x() / camera.fx), static_cast<float>(at.y() / camera.fy), 1.0F);
  }
  return plain_scene(corners, {0.0F});
}

/// The area of a unit square around (x, y) in which u cos(a) + v sin(a) >= offset.
double white_area(double x, double y, double angle, double offset) {
  // The integral of a box over the projection of the square: a trapezium with these half-widths.
  const double a = std::abs(std::cos(angle)) / 2, b = std::abs(std::sin(angle)) / 2;
  const double d = x * std::cos(angle) + y * std::sin(angle) - offset;
  const double big = std::max(a, b), small = std::max(std::min(a, b), 1e-5);
  if (std::abs(d) > big + small) return d > 0 ? 1 : 0;
  const auto ramp2 = [](double t) { return t > 0 ? 0.5 * t * t : 0.0; };
  const double sum = ramp2(d + big + small) - ramp2(d + big - small) - ramp2(d - big + small) + ramp2(d - big - small);
  return std::clamp(sum / (4 * big * small), 0.0, 1.0);
}

TEST(RasterRenderer, APixelOnAnEdgeIsTheExactMeanOverItsArea) {
  const Camera model = test::distorted_camera(0);
  for (const double angle : {0.0, 0.3, 0.8, std::numbers::pi / 2, 2.0}) {
    for (const double offset : {1.37, 1.5, 1.81}) {
      const Sample sample = seen(black_half_plane(angle, offset, model), model);
      int between = 0;
      for (int y = 0; y < model.height; ++y) {
        for (int x = 0; x < model.width; ++x) {
          const double expected = white_area(x - model.cx, y - model.cy, angle, offset);
          EXPECT_NEAR(sample.irradiance(x, y), expected, 1e-3) << x << ", " << y << " at " << angle;
          between += expected > 0.01 && expected < 0.99 ? 1 : 0;
        }
      }
      ASSERT_GT(between, 50);
    }
  }
}

TEST(RasterRenderer, SharedEdgesHaveNeitherCracksNorDoubleCoverage) {
  // Grids of random points that fill the view, of the same albedo as nothing else: any crack lets the background
  // through, and any double coverage would make a pixel brighter.
  std::mt19937 random(3);
  std::uniform_real_distribution<float> jitter(-0.45F, 0.45F), depth(1.0F, 1.6F);
  for (const int distortion : {0, 1, 2, 3}) {
    const Camera model = test::distorted_camera(distortion);
    for (int mesh = 0; mesh < 12; ++mesh) {
      constexpr int kCells = 24;
      std::vector<Eigen::Vector3f> points;
      for (int i = 0; i < (kCells + 1) * (kCells + 1); ++i) {
        const auto column = static_cast<float>(i % (kCells + 1)), row = static_cast<float>(i / (kCells + 1));
        const float z = depth(random);
        const float half = 0.5F * kCells;
        points.emplace_back(4 * z * (column - half + jitter(random)) / half,
                            4 * z * (row - half + jitter(random)) / half, z);
      }
      std::vector<Eigen::Vector3f> corners;
      for (int row = 0; row < kCells; ++row) {
        for (int column = 0; column < kCells; ++column) {
          const auto at = [&](int dx, int dy) {
            return points[static_cast<std::size_t>((row + dy) * (kCells + 1) + column + dx)];
          };
          for (const auto& corner : {at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)})
            corners.push_back(corner);
        }
      }
      const Sample sample = seen(plain_scene(corners, std::vector<float>(corners.size() / 3, 0.5F)), model, 16, 100.0F);
      for (const float e : sample.irradiance.pixels()) ASSERT_NEAR(e, 0.5, 0.004) << distortion << " " << mesh;
    }
  }
}

/// The mean albedo of what is seen in a pixel, by a search of all triangles at a grid of points.
double searched(const std::vector<Eigen::Vector3f>& corners, const std::vector<float>& albedos, const Camera& camera,
                int x, int y, double background) {
  constexpr int kGrid = 24;
  std::vector<std::size_t> near;  // triangles that are partly behind the camera, or whose box meets that of the pixel
  for (std::size_t k = 0; k < albedos.size(); ++k) {
    const auto beyond = [&](int axis, double to, float sign) {  // in the direction of the sign
      return std::ranges::all_of(std::span(corners).subspan(3 * k, 3), [&](const Eigen::Vector3f& corner) {
        const Eigen::Vector2d at(corner.x() / corner.z() * camera.fx + camera.cx,
                                 corner.y() / corner.z() * camera.fy + camera.cy);
        return corner.z() > 0.1F && sign * (at[axis] - to) > 0;
      });
    };
    if (!beyond(0, x + 1, 1) && !beyond(0, x - 1, -1) && !beyond(1, y + 1, 1) && !beyond(1, y - 1, -1))
      near.push_back(k);
  }
  double sum = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const Eigen::Vector3d ray((x + (i % kGrid + 0.5) / kGrid - 0.5 - camera.cx) / camera.fx,
                              (y + (i / kGrid + 0.5) / kGrid - 0.5 - camera.cy) / camera.fy, 1);
    double nearest = std::numeric_limits<double>::infinity(), value = background;
    for (const std::size_t k : near) {
      const Eigen::Vector3d a = corners[3 * k].cast<double>(), b = corners[3 * k + 1].cast<double>(),
                            c = corners[3 * k + 2].cast<double>(), normal = (b - a).cross(c - a);
      const double z = normal.dot(a) / normal.dot(ray);  // of the point on the plane
      if (!(z > 1e-3) || z >= nearest) continue;
      const Eigen::Vector3d p = z * ray;
      const double u = normal.dot((b - a).cross(p - a)), v = normal.dot((c - b).cross(p - b)),
                   w = normal.dot((a - c).cross(p - c));
      if (std::min({u, v, w}) < 0) continue;
      nearest = z, value = static_cast<double>(albedos[k]);
    }
    sum += value;
  }
  return sum / (kGrid * kGrid);
}

/// Compares images of random triangles, of which some are behind the camera, with the search.
void expect_random_triangles(int triangles, double largest, double rms) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> across(-1.2F, 1.2F), depth(-0.5F, 3.0F), albedo(0.0F, 1.0F);
  Camera model = test::distorted_camera(0);
  double squares = 0, count = 0;
  for (int mesh = 0; mesh < 40; ++mesh) {
    std::vector<Eigen::Vector3f> corners;
    std::vector<float> albedos;
    for (int k = 0; k < triangles; ++k) {
      albedos.push_back(albedo(random));
      for (int corner = 0; corner < 3; ++corner) {
        const float z = depth(random);  // also behind the camera: triangles are clipped
        corners.emplace_back(2 * across(random), 2 * across(random), z);
      }
    }
    const Sample sample = seen(plain_scene(corners, albedos), model, 16, 0.3F);
    std::uniform_int_distribution<int> column(0, model.width - 1), row(0, model.height - 1);
    for (int i = 0; i < 60; ++i) {
      const int x = column(random), y = row(random);
      const double error = static_cast<double>(sample.irradiance(x, y)) - searched(corners, albedos, model, x, y, 0.3);
      EXPECT_LT(std::abs(error), largest) << mesh << ": " << x << ", " << y;
      squares += error * error, ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), rms);
}

TEST(RasterRenderer, RandomTrianglesAreWhatASlowSearchSees) { expect_random_triangles(12, 0.06, 0.006); }

TEST(RasterRenderer, ManyRandomTrianglesAreWhatASlowSearchSees) { expect_random_triangles(60, 0.12, 0.02); }

/// An octahedron, divided `times` times, with the corners of a sphere moved by up to `dents` of its radius.
std::vector<Eigen::Vector3f> dented_ball(const Eigen::Vector3f& centre, float radius, float dents, int times,
                                         std::mt19937& random) {
  std::vector<Eigen::Vector3f> corners;
  for (const float x : {-1.0F, 1.0F})
    for (const float y : {-1.0F, 1.0F})
      for (const float z : {-1.0F, 1.0F})
        for (const Eigen::Vector3f& corner : {Eigen::Vector3f(x, 0, 0), {0, y, 0}, {0, 0, z}})
          corners.push_back(corner);
  for (int k = 0; k < times; ++k) {
    std::vector<Eigen::Vector3f> finer;
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      const auto middle = [&](std::size_t a, std::size_t b) {
        return Eigen::Vector3f((corners[i + a] + corners[i + b]).normalized());
      };
      const Eigen::Vector3f ab = middle(0, 1), bc = middle(1, 2), ca = middle(2, 0);
      for (const Eigen::Vector3f& corner :
           {corners[i], ab, ca, corners[i + 1], bc, ab, corners[i + 2], ca, bc, ab, bc, ca})
        finer.push_back(corner);
    }
    corners = finer;
  }
  std::uniform_real_distribution<float> moved(1 - dents, 1.0F);
  std::map<std::array<float, 3>, Eigen::Vector3f> places;  // one for all triangles at a corner
  for (Eigen::Vector3f& corner : corners) {
    const std::array<float, 3> key{corner.x(), corner.y(), corner.z()};
    if (!places.contains(key)) places[key] = centre + radius * moved(random) * corner;
    corner = places[key];
  }
  return corners;
}

TEST(RasterRenderer, ConnectedBodiesAreWhatASlowSearchSees) {
  // Dented balls, each of one colour, whose triangles are larger and smaller than a pixel: outlines, folds, backs, and
  // bodies that meet.
  std::mt19937 random(11);
  std::uniform_real_distribution<float> across(-0.7F, 0.7F), depth(1.5F, 2.5F), size(0.15F, 0.7F), albedo(0.0F, 1.0F);
  const Camera model = test::distorted_camera(0);
  double squares = 0, count = 0;
  for (int mesh = 0; mesh < 40; ++mesh) {
    std::vector<Eigen::Vector3f> corners;
    Mesh bodies;
    std::vector<float> albedos;
    for (std::uint16_t body = 0; body < 4; ++body) {
      const float z = depth(random), dents = std::array{0.0F, 0.1F, 0.4F}[static_cast<std::size_t>(mesh) % 3];
      const Eigen::Vector3f centre(z * across(random), z * across(random), z);
      const auto ball = dented_ball(centre, size(random), dents, 2 + body % 2, random);
      bodies.materials.push_back({"plain", nullptr, albedo(random)});
      corners.insert(corners.end(), ball.begin(), ball.end());
      bodies.material.resize(corners.size() / 3, body);
      albedos.resize(corners.size() / 3, bodies.materials.back().base);
    }
    bodies.vertices = corners;
    for (std::uint32_t i = 0; i < albedos.size(); ++i) bodies.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    bodies.texture_uv.resize(albedos.size(), {Eigen::Vector2f(0, 0), Eigen::Vector2f(0, 0), Eigen::Vector2f(0, 0)});
    const Sample sample = seen(still_scene(bodies), model, 16, 0.3F);
    std::uniform_int_distribution<int> column(0, model.width - 1), row(0, model.height - 1);
    for (int i = 0; i < 200; ++i) {
      const int x = column(random), y = row(random);
      const double error = static_cast<double>(sample.irradiance(x, y)) - searched(corners, albedos, model, x, y, 0.3);
      EXPECT_LT(std::abs(error), 0.06) << mesh << ": " << x << ", " << y;
      squares += error * error, ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.008);
}

TEST(RasterRenderer, FineTrianglesShowTheTextureOfTheirSurface) {
  // A slanted textured square of two triangles, and of thousands with corners anywhere in it.
  std::mt19937 random(17);
  std::uniform_real_distribution<float> grey(0.2F, 1.0F), jitter(-0.3F, 0.3F);
  Image<float> picture(64, 64);
  for (float& e : picture.pixels()) e = grey(random);
  const auto texture = std::make_shared<const Texture>(picture, Wrap::clamp, Wrap::clamp);
  const auto square = [&](int cells) {
    Mesh mesh;
    mesh.materials.push_back({"picture", texture, 1.0F});
    std::vector<Eigen::Vector2f> uv;
    for (int row = 0; row <= cells; ++row) {
      for (int column = 0; column <= cells; ++column) {
        const auto inside = [&](int k) {
          const float moved = k > 0 && k < cells ? jitter(random) : 0.0F;
          return (static_cast<float>(k) + moved) / static_cast<float>(cells);
        };
        const float u = inside(column), v = inside(row);
        uv.emplace_back(u, v);
        mesh.vertices.emplace_back(4 * u - 2, 4 * v - 2, 2 + 0.8F * u);
      }
    }
    for (int row = 0; row < cells; ++row) {
      for (int column = 0; column < cells; ++column) {
        const auto at = [&](int dx, int dy) {
          return static_cast<std::uint32_t>((row + dy) * (cells + 1) + column + dx);
        };
        for (const auto& corners : {std::array{at(0, 0), at(1, 0), at(1, 1)}, {at(0, 0), at(1, 1), at(0, 1)}}) {
          mesh.triangles.push_back(corners);
          mesh.texture_uv.push_back({uv[corners[0]], uv[corners[1]], uv[corners[2]]});
          mesh.material.push_back(0);
        }
      }
    }
    return still_scene(mesh);
  };
  const Camera model = test::distorted_camera(0);
  const Sample expected = seen(square(1), model);
  for (const int cells : {9, 40, 90}) {
    const Sample actual = seen(square(cells), model);
    for (std::size_t i = 0; i < expected.irradiance.pixels().size(); ++i)
      ASSERT_NEAR(actual.irradiance.pixels()[i], expected.irradiance.pixels()[i], 2e-3) << cells << ": pixel " << i;
  }
}

TEST(RasterRenderer, ManySmallTrianglesHaveTheOutlineOfTheirSurface) {
  // The black half-plane in triangles of 0.4 px, of which a pixel sees a dozen.
  const Camera model = test::distorted_camera(0);
  int others = 0;
  for (const double angle : {0.0, 0.3, 0.8, 2.0}) {
    const double offset = 1.37;
    const Eigen::Vector2d normal(std::cos(angle), std::sin(angle)), along(-normal.y(), normal.x());
    std::vector<Eigen::Vector3f> corners;
    const auto corner = [&](int n, int s) {
      const Eigen::Vector2d at = (offset - 0.4 * n) * normal + 0.4 * s * along;
      return Eigen::Vector3f(static_cast<float>(at.x() / model.fx), static_cast<float>(at.y() / model.fy), 1.0F);
    };
    for (int n = 0; n < 12; ++n) {
      for (int s = -40; s < 40; ++s) {
        for (const auto& c : {corner(n, s), corner(n + 1, s), corner(n + 1, s + 1), corner(n, s), corner(n, s + 1),
                              corner(n + 1, s + 1)})
          corners.push_back(c);
      }
    }
    const Sample sample = seen(plain_scene(corners, std::vector<float>(corners.size() / 3, 0.0F)), model);
    for (int y = 0; y < model.height; ++y) {
      for (int x = 0; x < model.width; ++x) {
        const Eigen::Vector2d at(x - model.cx, y - model.cy);
        if (std::abs(at.dot(along)) > 14 || at.dot(normal) < offset - 4) continue;
        const double error = sample.irradiance(x, y) - white_area(at.x(), at.y(), angle, offset);
        // The last sample of either side decides whether it is seen at all.
        EXPECT_LT(std::abs(error), 1.0 / 64) << x << ", " << y << " at " << angle;
        others += std::abs(error) > 1e-4 ? 1 : 0;
      }
    }
  }
  EXPECT_LT(others, 10);
}

TEST(ClippedTriangles, AreWhatAPolygonIsCutDownTo) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> at(-1.2F, 1.2F);
  ClippedTriangles triangles;
  for (const float size : {0.3F, 1.0F, 8.0F, 300.0F}) {
    for (int i = 0; i < 2000; ++i) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        for (std::size_t lane = 0; lane < ClippedTriangles::kCount; ++lane)
          triangles.s[corner][lane] = size * at(random), triangles.t[corner][lane] = size * at(random);
      }
      if (i % 3 == 0) triangles.t[1] = triangles.t[0];  // sides along rows and columns
      if (i % 5 == 0) triangles.s[2] = triangles.s[1];
      triangles.integrate();
      for (std::size_t lane = 0; lane < ClippedTriangles::kCount; ++lane) {
        const auto s = [&](std::size_t corner) { return triangles.s[corner % 3][lane]; };
        const auto t = [&](std::size_t corner) { return triangles.t[corner % 3][lane]; };
        const float side = (s(1) - s(0)) * (t(2) - t(0)) - (t(1) - t(0)) * (s(2) - s(0)) < 0 ? -1.0F : 1.0F;
        Convex polygon = Convex::pixel(), rest;
        for (std::size_t corner = 0; corner < 3 && !polygon.empty(); ++corner) {
          const float ds = side * (s(corner + 1) - s(corner)), dt = side * (t(corner + 1) - t(corner));
          polygon.cut({dt * s(corner) - ds * t(corner), -dt, ds}, rest);
        }
        Moments expected;
        if (!polygon.empty()) polygon.integrate(expected);
        const Moments actual = triangles.moments(lane);
        const float tolerance = 2e-6F * std::max(size, 1.0F);
        ASSERT_NEAR(actual.area, expected.area, tolerance);
        ASSERT_NEAR(actual.s, expected.s, tolerance);
        ASSERT_NEAR(actual.t, expected.t, tolerance);
        ASSERT_NEAR(actual.ss, expected.ss, tolerance);
        ASSERT_NEAR(actual.st, expected.st, tolerance);
        ASSERT_NEAR(actual.tt, expected.tt, tolerance);
      }
    }
  }
}

TEST(RasterRenderer, NoSurfaceShowsTheTextureBesideIt) {
  // A black surface over a black background, whose texture continues in white next to the part that the surface shows,
  // as in an atlas of many surfaces. A pixel has 12 texels along each side.
  const Camera model = test::distorted_camera(0);
  constexpr int kSize = 2048;
  Image<float> atlas(kSize, kSize, 1.0F);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize / 2; ++x) atlas(x, y) = 0;
  const auto texture = std::make_shared<const Texture>(atlas, Wrap::clamp, Wrap::clamp);
  for (const double angle : {0.0, 0.3, 0.8, 2.0}) {
    Scene scene = black_half_plane(angle, 1.37, model);
    Mesh& mesh = scene.objects[0].mesh;
    mesh.materials[0] = {"atlas", texture, 1.0F};
    const double texels = 12 / (kSize / 2.0);  // half of the texture per px
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const double n = corner < 2 ? 0 : -1e3 - 1.37, s = corner == 0 ? -1e3 : corner == 1 ? 1e3 : 0;
      mesh.texture_uv[0][corner] = {static_cast<float>(0.5 + 0.5 * texels * n),
                                    static_cast<float>(0.5 + 0.5 * texels * s)};
    }
    const Sample sample = seen(scene, model, 16, 0.0F);
    float brightest = 0;
    for (const float e : sample.irradiance.pixels()) brightest = std::max(brightest, e);
    EXPECT_LT(brightest, 0.04F) << angle;
  }
}

TEST(RasterRenderer, WhatNoSceneShouldContainIsSafe) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  const Camera model = test::distorted_camera(1);
  const std::vector<std::vector<Eigen::Vector3f>> corners{
      {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}},   // no area
      {{-1, 0, 1}, {1, 0, 1}, {0, 0, 1}},  // a line
      {{-1e30F, -1e30F, 1}, {1e30F, -1e30F, 1}, {0, 1e30F, 1}},
      {{-1, -1, 1e30F}, {1, -1, 1e30F}, {0, 1, 1e30F}},
      {{-1, -1, 1e-30F}, {1, -1, 1e-30F}, {0, 1, -1e-30F}},
      {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}},  // the camera is in it
      {{-1, -1, -1}, {1, -1, 2}, {0, 1, -3}},
  };
  for (const auto& triangle : corners) {
    for (const int samples : {1, 16, 64}) {
      const Sample sample = seen(plain_scene(triangle, {0.5F}), model, samples);
      for (const float e : sample.irradiance.pixels()) ASSERT_TRUE(e >= 0.49F && e <= 1.01F) << e;
    }
  }
  for (const float bad : {kNaN, kInfinity}) {
    try {  // an error, or a picture
      const Sample sample = seen(plain_scene({{bad, 0, 1}, {1, bad, 1}, {0, 1, 1}}, {0.5F}), model);
      for (const float e : sample.irradiance.pixels()) ASSERT_TRUE(std::isfinite(e));
    } catch (const UserError&) {
    }
  }
}

TEST(RasterRenderer, NumbersOfSamplesAreChecked) {
  EXPECT_THROW(seen(plain_scene({{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {0.5F}), test::distorted_camera(0), 4), UserError);
}

}  // namespace
}  // namespace esim
