// Samples from a cache under a renderer that counts what it renders.
#include "esim/image_cache/cached_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "esim/render/bands.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

constexpr int kWidth = 45, kHeight = 31;

/// Images that depend on the poses and on a scene.
class Engine final : public Renderer {
 public:
  Engine(const Camera& camera, float scene, int& rendered, const Workers& workers)
      : rays_(camera), scene_(scene), rendered_(rendered), workers_(workers) {}

  RendererTraits traits() const override { return {.name = "engine", .granularity = Granularity::frame}; }

  std::unique_ptr<Rendering> start(RenderRequest request) override {
    return std::make_unique<InProgress>(*this, std::move(request));
  }

 private:
  struct InProgress final : Rendering {
    InProgress(Engine& from, RenderRequest what) : engine(from), request(std::move(what)) {}
    void finish(Sample& sample) override {
      ++engine.rendered_;
      const auto at = static_cast<float>(request.camera.T_world_body.translation.x());
      render_in_bands({&request, 1}, engine.rays_, engine.workers_, sample, [&](std::size_t, const Tile& band) {
        for (int y = band.y; y < band.y + band.height; ++y) {
          for (int x = band.x; x < band.x + band.width; ++x) {
            sample.irradiance(x, y) = std::exp(std::sin(0.3F * static_cast<float>(x * y) + at)) + engine.scene_;
            const bool sky = (x + y) % 7 == 0;
            sample.depth(x, y) =
                sky ? std::numeric_limits<float>::infinity() : 2 + std::cos(static_cast<float>(x) - at);
            if (!request.objects.empty())
              sample.object(x, y) =
                  static_cast<std::uint16_t>((x + 2 * y) % (static_cast<int>(request.objects.size()) + 1));
          }
        }
      });
    }
    Engine& engine;
    RenderRequest request;
  };

  PixelRays rays_;
  float scene_;
  int& rendered_;
  const Workers& workers_;
};

/// The bytes of the requested pixels.
std::string bytes_of(const Sample& sample, int motion_rows = 1) {
  std::string bytes(reinterpret_cast<const char*>(&sample.t), sizeof sample.t);
  const auto add = [&]<typename T>(const Image<T>& image, int every) {
    for (const Tile& tile : sample.tiles) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        if (y % every == 0)
          bytes.append(reinterpret_cast<const char*>(image.row(y) + tile.x),
                       static_cast<std::size_t>(tile.width) * sizeof(T));
      }
    }
  };
  add(sample.irradiance, 1), add(sample.depth, 1);
  add(sample.motion_x, motion_rows), add(sample.motion_y, motion_rows);
  if (!sample.object.empty()) add(sample.object, 1);
  return bytes;
}

class CachedRenderer : public testing::Test {
 protected:
  RenderRequest request(double x = 0.5) const {
    RenderRequest request{7, {}, {{0, 0, kWidth, kHeight}}};
    request.camera.T_world_body.translation.x() = x;
    request.camera.velocity_world = {0.3, -0.2, 1};
    request.camera.omega_body = {0.1, 0.2, -0.3};
    return request;
  }
  static Kinematics object(double x) {
    Kinematics object;
    object.T_world_body.translation.x() = x;
    object.velocity_world = {1, 2, 3};
    return object;
  }

  /// A new renderer's sample.
  std::string sample_of(const RenderRequest& request, const std::string& scene = "scene", bool cached = true) {
    const auto cache = std::make_shared<ImageCache>(folder_.path(), std::uint64_t{1} << 30,
                                                    [](const std::string& text) { ADD_FAILURE() << text; });
    auto engine = std::make_unique<Engine>(camera_, static_cast<float>(scene.size()), rendered_, workers_);
    const auto renderer = with_image_cache(std::move(engine), cached ? cache : nullptr, scene, camera_, workers_);
    Sample sample;
    renderer->render(request, sample);
    EXPECT_EQ(cache->from_cache + cache->from_engine, cached ? 1 : 0);
    return bytes_of(sample, request.motion_rows);
  }

  /// Whether a request is answered without the engine. In any case, its sample must be the engine's.
  bool is_cached(const RenderRequest& request, const std::string& scene = "scene") {
    const int before = rendered_;
    const std::string sample = sample_of(request, scene);
    const bool cached = rendered_ == before;
    EXPECT_TRUE(sample == sample_of(request, scene, false));
    return cached;
  }

  const test::TemporaryDirectory folder_;
  const Workers workers_{2};
  Camera camera_ = Camera::from_fov(kWidth, kHeight, 1.2);
  int rendered_ = 0;
};

TEST_F(CachedRenderer, TheSameRequestIsRenderedOnce) {
  EXPECT_FALSE(is_cached(request()));
  EXPECT_TRUE(is_cached(request()));
  EXPECT_TRUE(is_cached(request()));
}

TEST_F(CachedRenderer, OtherTimesAndTwistsHaveTheSameImages) {
  is_cached(request());
  RenderRequest other = request();
  other.t = 1'000'000;
  other.camera.velocity_world = {-1, 0, 0.5};
  other.camera.omega_body = {0, 1, 0};
  EXPECT_TRUE(is_cached(other));
  other.motion_rows = 4;
  EXPECT_TRUE(is_cached(other));
  other.which_objects = true;
  EXPECT_TRUE(is_cached(other)) << "nothing moves";
}

TEST_F(CachedRenderer, WhateverDeterminesAnImageDistinguishesIt) {
  RenderRequest moving = request();
  moving.objects = {object(1), object(2)};
  EXPECT_FALSE(is_cached(request()));
  EXPECT_FALSE(is_cached(moving));
  EXPECT_TRUE(is_cached(moving));
  EXPECT_FALSE(is_cached(request(), "other scene"));
  EXPECT_FALSE(is_cached(request(std::nextafter(0.5, 1))));
  RenderRequest other = moving;
  other.objects[1].velocity_world.x() = 7;
  EXPECT_TRUE(is_cached(other));
  other.objects[1] = object(2.5);
  EXPECT_FALSE(is_cached(other));
  other.objects = {object(2), object(1)};
  EXPECT_FALSE(is_cached(other));
  other.objects = {object(1)};
  EXPECT_FALSE(is_cached(other));
  other = request();
  other.camera.T_world_body.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
  EXPECT_FALSE(is_cached(other));
  other = request();
  other.tiles = {{4, 3, 8, 9}, {12, 3, 20, 28}};
  EXPECT_FALSE(is_cached(other));
  EXPECT_TRUE(is_cached(other));
  other.tiles[1].width = 19;
  EXPECT_FALSE(is_cached(other));
  const Camera before = camera_;
  for (double Camera::*const number : {&Camera::fx, &Camera::fy, &Camera::cx, &Camera::cy}) {
    camera_ = before;
    camera_.*number += 0.01;
    EXPECT_FALSE(is_cached(request()));
  }
  camera_ = before;
  camera_.distortion = RadialTangential{0.01};
  EXPECT_FALSE(is_cached(request()));
  camera_.distortion = Equidistant{0.01};
  EXPECT_FALSE(is_cached(request()));
  camera_ = before;
  EXPECT_TRUE(is_cached(request())) << "nothing has replaced it";
}

TEST_F(CachedRenderer, RequestsAtSeveralTimesAreOneSample) {
  RenderRequest left = request(1), right = request(2);
  left.tiles = {{0, 0, 20, kHeight}};
  right.tiles = {{20, 0, kWidth - 20, kHeight}};
  const auto together = [&](bool cached) {
    const auto cache = std::make_shared<ImageCache>(folder_.path(), std::uint64_t{1} << 30, [](const std::string&) {});
    const auto renderer = with_image_cache(std::make_unique<Engine>(camera_, 0.0F, rendered_, workers_),
                                           cached ? cache : nullptr, "scene", camera_, workers_);
    Sample sample;
    renderer->start_together({left, right})->finish(sample);
    return bytes_of(sample);
  };
  const std::string plain = together(false);
  EXPECT_TRUE(together(true) == plain);
  const int before = rendered_;
  EXPECT_TRUE(together(true) == plain);
  EXPECT_EQ(rendered_, before);
}

}  // namespace
}  // namespace esim
