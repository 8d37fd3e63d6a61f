// The blur of a lens, against a convolution with the whole kernel.
#include "esim/render/point_spread.h"

#include <gtest/gtest.h>

#include <cmath>

#include "esim/core/error.h"
#include "render/scenes.h"

namespace esim {
namespace {

constexpr double kSigma = 1.3;

/// The image of `camera` with `margin` px more on each side.
Camera enlarged(Camera camera, int margin) {
  camera.width += 2 * margin, camera.height += 2 * margin, camera.cx += margin, camera.cy += margin;
  return camera;
}

double weight(const std::vector<float>& half, int distance) {
  const auto k = static_cast<std::size_t>(std::abs(distance));
  return k < half.size() ? double{half[k]} : 0.0;
}

class PointSpreadTest : public testing::Test {
 protected:
  std::unique_ptr<Renderer> make(bool sees_more) const {
    return with_point_spread([](const Camera& camera) { return test::make_renderer("raster", camera); }, camera_,
                             kSigma, sees_more, test::two_threads());
  }
  Sample view(Renderer& renderer, const Camera& camera) const {
    return test::render(renderer, camera, test::moving_camera(), {});
  }

  const Camera camera_ = test::distorted_camera(1);
};

TEST(GaussianHalfKernel, HasItsVariance) {
  for (const double sigma : {0.1, 0.3, 0.5, 1.0, 2.7, 9.0}) {
    const std::vector<float> half = gaussian_half_kernel(sigma);
    double sum = 0, variance = 0;
    for (int k = -100; k <= 100; ++k) sum += weight(half, k), variance += weight(half, k) * k * k;
    EXPECT_NEAR(sum, 1, 1e-6) << sigma;
    EXPECT_NEAR(variance, sigma * sigma, 1e-4 * sigma * sigma) << sigma;
    for (std::size_t k = 1; k < half.size(); ++k) EXPECT_LE(half[k], half[k - 1]) << sigma;
  }
}

TEST_F(PointSpreadTest, IsAConvolution) {
  const std::vector<float> half = gaussian_half_kernel(kSigma);
  const int reach = static_cast<int>(half.size()) - 1;
  const Camera larger = enlarged(camera_, reach);
  const Sample sharp = view(*test::make_renderer("raster", larger), larger), blurred = view(*make(true), camera_);
  double change = 0;
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      double sum = 0;
      for (int j = -reach; j <= reach; ++j) {
        for (int i = -reach; i <= reach; ++i)
          sum += weight(half, i) * weight(half, j) * double{sharp.irradiance(x + reach + i, y + reach + j)};
      }
      ASSERT_NEAR(double{blurred.irradiance(x, y)}, sum, 2e-6) << x << ", " << y;
      ASSERT_EQ(blurred.depth(x, y), sharp.depth(x + reach, y + reach));
      ASSERT_EQ(blurred.motion_x(x, y), sharp.motion_x(x + reach, y + reach));
      ASSERT_EQ(blurred.motion_y(x, y), sharp.motion_y(x + reach, y + reach));
      change = std::max(change, std::fabs(sum - double{sharp.irradiance(x + reach, y + reach)}));
    }
  }
  EXPECT_GT(change, 0.001) << "the scene should have something to blur";
}

TEST_F(PointSpreadTest, CanRepeatPixelsAtTheBorder) {
  const std::vector<float> half = gaussian_half_kernel(kSigma);
  const Sample sharp = view(*test::make_renderer("raster", camera_), camera_), blurred = view(*make(false), camera_);
  for (const auto& [x, y] : {std::pair{0, 0}, {119, 89}, {0, 40}, {57, 89}, {60, 45}}) {
    double sum = 0;
    for (int j = -8; j <= 8; ++j) {
      for (int i = -8; i <= 8; ++i)
        sum += weight(half, i) * weight(half, j) *
               double{sharp.irradiance(std::clamp(x + i, 0, 119), std::clamp(y + j, 0, 89))};
    }
    EXPECT_NEAR(double{blurred.irradiance(x, y)}, sum, 2e-6) << x << ", " << y;
  }
}

TEST_F(PointSpreadTest, TilesAtSeveralTimesAreThoseOfWholeImages) {
  const std::unique_ptr<Renderer> renderer = make(true);
  const std::vector<std::vector<Tile>> tiles = {{{0, 0, 30, 20}, {30, 0, 10, 5}, {50, 60, 7, 30}},
                                                {{30, 5, 10, 15}, {0, 20, 120, 3}}};
  std::vector<RenderRequest> requests;
  for (std::size_t i = 0; i < tiles.size(); ++i)
    requests.push_back({test::kTime, test::moving_camera(0.01 * static_cast<double>(i)), tiles[i]});
  Sample together;
  renderer->start_together(requests)->finish(together);
  EXPECT_EQ(together.tiles.size(), 5U);
  for (RenderRequest& request : requests) {
    const std::vector<Tile> wanted = request.tiles;
    request.tiles = {{0, 0, camera_.width, camera_.height}};
    Sample whole;
    renderer->render(request, whole);
    for (const Tile& tile : wanted) {
      for (int y = tile.y; y < tile.y + tile.height; ++y) {
        for (int x = tile.x; x < tile.x + tile.width; ++x) {
          ASSERT_EQ(together.irradiance(x, y), whole.irradiance(x, y)) << x << ", " << y;
          ASSERT_EQ(together.depth(x, y), whole.depth(x, y));
        }
      }
    }
  }
}

TEST_F(PointSpreadTest, RefusesLensesThatEndAtTheImage) {
  Camera camera = camera_;
  camera.distortion = RadialTangential{-0.2, 0, 0, 0, 0};
  ASSERT_NO_THROW(camera.validate());
  const auto make_sharp = [](const Camera& larger) { return test::make_renderer("raster", larger); };
  try {
    with_point_spread(make_sharp, camera, 10, true, test::two_threads());
    FAIL() << "should have thrown";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("psf_px: 10 needs light from 40 px outside the image"), std::string::npos)
        << error.what();
  }
  EXPECT_NO_THROW(with_point_spread(make_sharp, camera, 10, false, test::two_threads()));
}

}  // namespace
}  // namespace esim
