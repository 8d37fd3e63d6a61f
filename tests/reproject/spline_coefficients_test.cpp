#include "esim/reproject/spline_coefficients.h"

#include <gtest/gtest.h>

#include <cmath>

#include "esim/core/random.h"

namespace esim {
namespace {

const Workers kWorkers(2);

/// The spline at (x, y), at least one pixel from the borders.
double at(const Image<float>& coefficients, double x, double y) {
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const CubicSpline across(static_cast<float>(x - i)), down(static_cast<float>(y - j));
  const auto row = [&](int k) {
    const float* const c = coefficients.row(k) + i - 1;
    return across(c[0], c[1], c[2], c[3]);
  };
  return down(row(j - 1), row(j), row(j + 1), row(j + 2));
}

template <typename Function>
Image<float> image_of(int width, int height, const Function& f) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(f(x, y));
  return image;
}

TEST(SplineCoefficients, PassThroughThePixels) {
  const AddressedRandom random(3, Purpose::test);
  for (const auto& [width, height] : {std::pair(70, 33), {5, 5}, {129, 4}}) {
    const Image<float> image = image_of(
        width, height, [&](int x, int y) { return random.uniforms(static_cast<std::uint32_t>(y * 1000 + x))[0]; });
    Image<float> coefficients = image;
    to_spline_coefficients(coefficients, kWorkers);
    for (int y = 1; y < height - 2; ++y)
      for (int x = 1; x < width - 2; ++x) EXPECT_NEAR(at(coefficients, x, y), image(x, y), 2e-6) << x << " " << y;
  }
}

TEST(SplineCoefficients, ReproducePolynomialsOfTheThirdDegree) {
  const auto f = [](double x, double y) {
    const double a = x / 40 - 0.5, b = y / 40 - 0.4;
    return 1 + a - 2 * b + a * b + 3 * a * a * a - b * b * b + a * a * b;
  };
  Image<float> coefficients = image_of(80, 80, f);
  to_spline_coefficients(coefficients, kWorkers);
  for (double y = 20; y < 60; y += 1.37)
    for (double x = 20; x < 60; x += 2.19) EXPECT_NEAR(at(coefficients, x, y), f(x, y), 3e-6);
}

// The sharpness stated in spline_coefficients.h.
TEST(SplineCoefficients, KeepAFourthOfThePixelsFrequency) {
  const auto f = [](double x, double) { return std::cos(M_PI / 2 * (x - 40.5)); };
  Image<float> coefficients = image_of(80, 8, f);
  to_spline_coefficients(coefficients, kWorkers);
  EXPECT_NEAR(at(coefficients, 40.5, 4), 0.97, 0.005);
}

}  // namespace
}  // namespace esim
