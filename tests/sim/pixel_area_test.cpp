// The area of pixels and the blur of the lens within simulations.
#include <cmath>

#include "esim/sim/simulate.h"
#include "sim/card_scene.h"

namespace esim {
namespace {

class PixelAreaOptions : public test::CardScene {
 protected:
  PixelAreaOptions() {
    mesh().engine = MeshEngine::raster;
    mesh().samples_per_pixel = 16;
    scenario_.duration_s = 1;
  }

  CameraOptions& camera() { return scenario_.cameras[0]; }

  /// A row of the image while the card is in front of the camera.
  std::vector<double> row() {
    const World world = build_world(scenario_, 1, {[](const std::string&) {}, [](const std::string&) {}});
    Sample sample;
    world.cameras[0].renderer->render(view(world, 0, world.info.start + to_ns(0.5)), sample);
    const float* const values = sample.irradiance.row(24);
    return {values, values + sample.irradiance.width()};
  }

  /// The light of a card from 22.71 to 40.29 px, averaged over `side` px around each pixel's centre.
  std::vector<double> expected(double side) {
    const double half = 0.1 * 32 / std::tan(20 * 3.14159265358979 / 180);
    std::vector<double> values;
    for (int x = 0; x < 64; ++x) {
      const double from = std::max(x - 0.5 * side, 31.5 - half), to = std::min(x + 0.5 * side, 31.5 + half);
      values.push_back(0.2 + 0.8 * std::max(0.0, to - from) / side);
    }
    return values;
  }
};

TEST_F(PixelAreaOptions, FillFactorIsThePartOfThePixelThatSees) {
  for (const auto engine : {MeshEngine::raster, MeshEngine::raycast}) {
    mesh().engine = engine;
    for (const double fill_factor : {1.0, 0.49, 0.04}) {
      camera().fill_factor = fill_factor;
      const std::vector<double> seen = row(), wanted = expected(std::sqrt(fill_factor));
      for (std::size_t x = 0; x < seen.size(); ++x)
        EXPECT_NEAR(seen[x], wanted[x], engine == MeshEngine::raster ? 1e-3 : 0.05) << x << ", " << fill_factor;
    }
  }
}

TEST_F(PixelAreaOptions, LensBlurSpreadsLight) {
  const std::vector<double> sharp = row();
  camera().psf_px = 1.5;
  const std::vector<double> blurred = row();
  // The mean of a Gaussian and a step, far from the card's other edge.
  for (int x = 34; x < 48; ++x) {
    double sum = 0, weights = 0;
    for (int k = -6; k <= 6; ++k) {
      const double weight = std::exp(-0.5 * k * k / (1.5 * 1.5));
      sum += weight * sharp[static_cast<std::size_t>(x + k)], weights += weight;
    }
    EXPECT_NEAR(blurred[static_cast<std::size_t>(x)], sum / weights, 2e-4) << x;
  }
  EXPECT_GT(blurred[42], sharp[42] + 0.05);
}

TEST_F(PixelAreaOptions, RefusesWhatExcludesThem) {
  camera().fill_factor = 0.5;
  camera().sampling = KeyframeSampling{};
  EXPECT_EQ(error(), "camera cam0: fill_factor cannot be used with keyframes; remove one of them");
  camera().sampling = FlowSampling{};
  camera().colour = ColourFilters::rggb;
  EXPECT_EQ(error(), "camera cam0: fill_factor cannot be used with colour filters; remove one of them");
  camera().fill_factor = 1, camera().psf_px = 0.5;
  EXPECT_EQ(error(), "camera cam0: psf_px cannot be used with colour filters; remove one of them");
}

}  // namespace
}  // namespace esim
