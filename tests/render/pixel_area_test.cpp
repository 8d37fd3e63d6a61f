// The irradiance of a pixel is the mean over its square: every renderer against images of 8 x 8 times as many pixels.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "render/every_renderer.h"

namespace esim {
namespace {

constexpr int kDenser = 8;  // along each side

/// Noise with equal contrast in each octave of spatial frequency, from 0 to 1, without the `left_out` finest ones.
std::shared_ptr<const Texture> pink_noise(int width, int height, int left_out) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 1);
  Image<float> image(width, height, 0.0F);
  constexpr int kOctaves = 6;
  for (int octave = left_out; octave < kOctaves; ++octave) {
    const int step = 1 << octave;
    Image<float> coarse(width / step, height / step);
    for (float& value : coarse.pixels()) value = uniform(random) / kOctaves;
    const Texture texture(coarse, Wrap::repeat, Wrap::repeat);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        TextureLookup<4> at{};
        at.u.fill((static_cast<float>(x) + 0.5F) / static_cast<float>(width));
        at.v.fill((static_cast<float>(y) + 0.5F) / static_cast<float>(height));
        image(x, y) += texture.sample(at)[0];
      }
    }
  }
  return std::make_shared<const Texture>(image, Wrap::repeat, Wrap::repeat);
}

/// About 1.6 texels per pixel of the panorama in the middle of test::distorted_camera(), 2 to 5 of the others, and more
/// where surfaces are seen obliquely.
std::unique_ptr<Renderer> make_textured(const std::string& name, int left_out, const Camera& camera) {
  const auto texture = pink_noise(1024, 512, left_out), fine = pink_noise(512, 512, left_out);
  if (name == "panorama") return make_panorama_renderer({texture}, camera, test::two_threads());
  if (name == "plane") {
    TexturedPlane plane = test::test_plane();
    plane.radiance = fine;
    return make_plane_renderer(plane, camera, test::two_threads());
  }
  if (name == "sprites") {
    SpriteScene scene = test::test_sprites();
    scene.sprites.erase(scene.sprites.begin());
    scene.sprites[0].light = fine;
    return make_sprites_renderer(scene, camera, test::two_threads());
  }
  Mesh box = test::box_mesh();
  box.materials[0].texture = fine;
  const Scene scene = still_scene(box);
  if (name == "gl") return make_gl_renderer(scene, {1.0F, 8}, camera);
  if (name == "raster") return make_raster_renderer(build_raster_scene(scene), {1.0F, 16}, camera, test::two_threads());
  return make_raycast_renderer(build_raycast_scene(scene), {1.0F, 64}, camera, test::two_threads());
}

class EveryTexturedRenderer : public testing::TestWithParam<std::tuple<const char*, int>> {};

TEST_P(EveryTexturedRenderer, ShowsTheMeanOverEachPixel) {
  const std::string name = std::get<0>(GetParam());
  if (name == "gl" && !test::has_gl()) GTEST_SKIP() << "no OpenGL: libegl1, libgl1-mesa-dri";
  const Camera camera = test::distorted_camera(std::get<1>(GetParam()));
  Camera dense = camera;
  dense.width *= kDenser, dense.height *= kDenser, dense.fx *= kDenser, dense.fy *= kDenser;
  dense.cx = (camera.cx + 0.5) * kDenser - 0.5, dense.cy = (camera.cy + 0.5) * kDenser - 0.5;

  // The filter of textures suppresses octaves that are finer than a pixel, but not as completely as a mean does.
  // Without the finest, the difference is that of the footprints; that of `gl` is at edges, where software renderers
  // have 4 samples per pixel.
  const double max_without = name == "gl" ? 0.005 : 0.003;
  for (const auto& [left_out, max_error] : {std::pair(0, 0.01), std::pair(2, max_without)}) {
    const auto show = [&, left = left_out](const Camera& seen_by) {
      return test::render(*make_textured(name, left, seen_by), seen_by, test::moving_camera()).irradiance;
    };
    const Image<float> seen = show(camera), densely = show(dense);
    double sum = 0, squares = 0, error2 = 0, exact_sum = 0, exact_squares = 0;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        double exact = 0;
        for (int j = 0; j < kDenser; ++j)
          for (int i = 0; i < kDenser; ++i) exact += densely(x * kDenser + i, y * kDenser + j);
        exact /= kDenser * kDenser;
        const double value = seen(x, y);
        sum += value, squares += value * value, error2 += (value - exact) * (value - exact);
        exact_sum += exact, exact_squares += exact * exact;
      }
    }
    const double count = camera.width * camera.height;
    const double contrast = std::sqrt(squares / count - std::pow(sum / count, 2));
    const double exact_contrast = std::sqrt(exact_squares / count - std::pow(exact_sum / count, 2));
    const double error = std::sqrt(error2 / count) / (exact_sum / count);
    RecordProperty("error_without_" + std::to_string(left_out), std::to_string(error));
    EXPECT_GT(exact_contrast, 0.05) << "not a test";
    EXPECT_NEAR(contrast / exact_contrast, 1, 0.02) << left_out;
    EXPECT_LT(error, max_error) << left_out;
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryTexturedRenderer,
                         testing::Combine(testing::Values("panorama", "plane", "sprites", "mesh", "raster"),
                                          testing::Values(0, 1)),
                         test::EveryRenderer::name);
// With lens distortion, `gl` is less sharp: docs/methods/rendering.md.
INSTANTIATE_TEST_SUITE_P(OpenGL, EveryTexturedRenderer, testing::Values(std::tuple("gl", 0)),
                         test::EveryRenderer::name);

}  // namespace
}  // namespace esim
