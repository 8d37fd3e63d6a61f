// OpenGL against the ray caster: two independent renderings of the same scene.
#include "esim/backends/opengl/gl_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "esim/core/error.h"
#include "esim/render/motion_field.h"
#include "render/scenes.h"

namespace esim {
namespace {

class GlRendererTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  }
};

RenderRequest request_with_objects(const Camera& model) {
  return {123, test::moving_camera(), {{0, 0, model.width, model.height}}, test::moving_objects(0)};
}

/// Differences between two samples, without pixels next to a depth edge.
struct Difference {
  double mean_irradiance = 0;                      // over all pixels
  double depth = 0, flow = 0, flow_tolerance = 0;  // maximum, away from edges; V relative to its tolerance
  int edges = 0, other_objects = 0;
};

Difference compare(const Sample& a, const Sample& b) {
  Difference result;
  const int width = a.depth.width(), height = a.depth.height();
  const auto is_edge = [&](int x, int y) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int u = std::clamp(x + dx, 0, width - 1), v = std::clamp(y + dy, 0, height - 1);
        if (!a.object.empty() && a.object(u, v) != a.object(x, y)) return true;
        // Creases are left out too: 1 / Z is linear on planes only (and nearly so through a lens).
        const int u2 = std::clamp(x - dx, 0, width - 1), v2 = std::clamp(y - dy, 0, height - 1);
        const double bend = 1.0 / a.depth(u, v) + 1.0 / a.depth(u2, v2) - 2.0 / a.depth(x, y);
        if (std::fabs(bend) * a.depth(x, y) > 2e-3) return true;
        if (std::isinf(a.depth(u, v)) != std::isinf(a.depth(x, y))) return true;
      }
    }
    return false;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      result.mean_irradiance += std::fabs(double{a.irradiance(x, y)} - b.irradiance(x, y)) / (width * height);
      if (is_edge(x, y)) {
        ++result.edges;
        continue;
      }
      if (!a.object.empty() && a.object(x, y) != b.object(x, y)) ++result.other_objects;
      const double flow = std::hypot(a.motion_x(x, y), a.motion_y(x, y));
      const double off = std::hypot(a.motion_x(x, y) - b.motion_x(x, y), a.motion_y(x, y) - b.motion_y(x, y));
      result.flow = std::max(result.flow, off / (0.05 + 1e-3 * flow));
      if (std::isinf(a.depth(x, y)) && std::isinf(b.depth(x, y))) continue;
      result.depth = std::max(result.depth, std::fabs(1.0 - double{b.depth(x, y)} / a.depth(x, y)));
    }
  }
  return result;
}

Sample render(Renderer& renderer, const RenderRequest& request) {
  Sample sample;
  renderer.render(request, sample);
  return sample;
}

void expect_agreement(const Scene& scene, const RenderRequest& request, const Camera& model) {
  const auto cast = make_raycast_renderer(build_raycast_scene(scene), {}, model, test::two_threads());
  const auto gl = make_gl_renderer(scene, {}, model);
  const Sample expected = render(*cast, request), sample = render(*gl, request);
  const Difference difference = compare(expected, sample);
  EXPECT_LT(difference.mean_irradiance, 0.01);
  EXPECT_LT(difference.depth, 1e-3);
  EXPECT_LT(difference.flow, 1);
  EXPECT_EQ(difference.other_objects, 0);
  EXPECT_LT(difference.edges, model.width * model.height / 4) << "too little is compared";
}

TEST_F(GlRendererTest, AgreesWithTheRayCasterOnMovingObjectsThroughEveryLens) {
  for (int kind = 0; kind < 4; ++kind) {
    SCOPED_TRACE(kind);
    const Camera model = test::distorted_camera(kind);
    expect_agreement(test::moving_scene(), request_with_objects(model), model);
  }
}

TEST_F(GlRendererTest, AgreesWithTheRayCasterUnderLights) {
  Scene scene = test::moving_scene();
  Lighting lighting;
  lighting.ambient = 0.2F;
  lighting.suns.push_back({{0.3F, -0.2F, -1.0F}, 0.7F});
  lighting.points.push_back({{0.5F, 0.4F, 1.0F}, 1.5F});
  scene.lighting = lighting;
  scene.objects[1].mesh.materials[0].emission = 0.3F;
  scene.objects[2].mesh.materials[0].unlit = true;
  const Camera model = test::distorted_camera(0);
  expect_agreement(scene, request_with_objects(model), model);
}

TEST_F(GlRendererTest, AgreesWithTheRayCasterOnTheOriginalsRoom) {
  const char* const data = std::getenv("ESIM_TEST_DATA");
  const std::filesystem::path room =
      std::filesystem::path(data != nullptr ? data : "") / "mesh/flying_room/flying_room.obj";
  if (!std::filesystem::exists(room)) GTEST_SKIP() << room << " is missing";
  const Scene scene = still_scene(load_mesh(room, [](const std::string&) {}));
  const Camera model = Camera::from_fov(346, 260, 1.3);
  for (const double turn : {0.0, 1.5, 3.0, 4.5}) {
    SCOPED_TRACE(turn);
    RenderRequest request{5, test::moving_camera(), {{0, 0, model.width, model.height}}, {}};
    SE3& pose = request.camera.T_world_body;
    pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())) * pose.rotation;
    pose.translation = {0.1, 0.2, 1.2};
    expect_agreement(scene, request, model);
  }
}

TEST_F(GlRendererTest, TheMotionFieldIsThatOfTheProcessor) {
  Scene scene = test::moving_scene();
  scene.objects[0].mesh.triangles.resize(6);  // three walls: there is an outside, too
  for (int kind = 0; kind < 4; ++kind) {
    for (const int samples : {1, 4}) {
      SCOPED_TRACE(testing::Message() << "distortion " << kind << ", " << samples << " samples");
      const Camera model = test::distorted_camera(kind);
      const RenderRequest request = request_with_objects(model);
      const Sample sample = render(*make_gl_renderer(scene, {0.2F, samples, {}}, model), request);
      Sample expected = sample;
      motion_field(PixelRays(model), relative_twists(request), request.tiles[0], expected);
      int outside = 0;
      for (int y = 0; y < model.height; ++y) {
        for (int x = 0; x < model.width; ++x) {
          const double off = std::hypot(sample.motion_x(x, y) - expected.motion_x(x, y),
                                        sample.motion_y(x, y) - expected.motion_y(x, y));
          ASSERT_LT(off, 0.01 + 1e-5 * std::hypot(expected.motion_x(x, y), expected.motion_y(x, y))) << x << ", " << y;
          if (std::isinf(sample.depth(x, y))) ++outside;
        }
      }
      EXPECT_GT(outside, 100);
    }
  }
}

TEST_F(GlRendererTest, SeveralSamplesPerPixelSmoothEdges) {
  const Camera model = test::distorted_camera(0);
  const RenderRequest request = request_with_objects(model);
  const Scene scene = test::moving_scene();
  const auto exact = make_raycast_renderer(build_raycast_scene(scene), {0.2F, 64}, model, test::two_threads());
  const Sample expected = render(*exact, request);
  const auto error = [&](int samples) {
    const auto gl = make_gl_renderer(scene, {0.2F, samples, {}}, model);
    const Sample sample = render(*gl, request);
    double sum = 0;
    for (std::size_t i = 0; i < sample.irradiance.size(); ++i)
      sum += std::pow(sample.irradiance.pixels()[i] - expected.irradiance.pixels()[i], 2);
    return std::sqrt(sum / static_cast<double>(sample.irradiance.size()));
  };
  EXPECT_LT(error(4), 0.6 * error(1));
}

TEST_F(GlRendererTest, RenderersInManyThreadsDoNotShareAContext) {
  const Camera model = test::distorted_camera(1);
  const RenderRequest request = request_with_objects(model);
  const Scene scene = test::moving_scene();
  const auto alone = make_gl_renderer(scene, {}, model);
  const Sample expected = render(*alone, request);
  std::vector<Sample> samples(4);
  std::vector<std::thread> threads;
  for (Sample& sample : samples) {
    threads.emplace_back([&] {
      const auto renderer = make_gl_renderer(scene, {}, model);
      for (int i = 0; i < 5; ++i) renderer->render(request, sample);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Sample& sample : samples) {
    EXPECT_TRUE(std::ranges::equal(sample.irradiance.pixels(), expected.irradiance.pixels()));
    EXPECT_TRUE(std::ranges::equal(sample.object.pixels(), expected.object.pixels()));
  }

  // A renderer may also change threads.
  Sample moved;
  std::thread([&] { alone->render(request, moved); }).join();
  EXPECT_TRUE(std::ranges::equal(moved.depth.pixels(), expected.depth.pixels()));
}

TEST_F(GlRendererTest, SaysWhatItCannotDo) {
  const Camera model = test::distorted_camera(0);
  const Scene scene = test::moving_scene();
  EXPECT_THROW(make_gl_renderer(scene, {0.2F, 1, 31}, model), UserError);
  Camera fisheye{346, 260, 110, 110, 172.5, 129.5, Equidistant{}};  // 180 degrees wide
  EXPECT_THROW(make_gl_renderer(scene, {}, fisheye), UserError);
}

TEST_F(GlRendererTest, NamesItsDevice) {
  const Camera model = test::distorted_camera(0);
  const auto renderer = test::make_renderer("gl", model);
  EXPECT_NE(renderer->traits().label().find("OpenGL"), std::string::npos);
  EXPECT_GT(renderer->traits().device.size(), std::string("OpenGL, ").size());
}

}  // namespace
}  // namespace esim
