// The drawing functions of previews and videos, compared with slow definitions.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "esim/preview/pictures.h"
#include "esim/preview/yuv.h"

namespace esim {
namespace {

Image<Rgb> noise(int width, int height) {
  std::mt19937 random(7);
  Image<Rgb> image(width, height);
  for (Rgb& pixel : image.pixels())
    pixel = {static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
             static_cast<std::uint8_t>(random())};
  return image;
}

/// The mean, in one colour, over the part of the original that a pixel of the enlarged image covers.
double covered_mean(const Image<Rgb>& image, int x, int y, int width, int height, int colour) {
  const double x0 = static_cast<double>(x) * image.width() / width,
               x1 = static_cast<double>(x + 1) * image.width() / width;
  const double y0 = static_cast<double>(y) * image.height() / height;
  const double y1 = static_cast<double>(y + 1) * image.height() / height;
  double sum = 0;
  for (int row = 0; row < image.height(); ++row) {
    for (int column = 0; column < image.width(); ++column) {
      const double across = std::min(x1, column + 1.0) - std::max(x0, double(column));
      const double down = std::min(y1, row + 1.0) - std::max(y0, double(row));
      if (across <= 0 || down <= 0) continue;
      const Rgb pixel = image(column, row);
      sum += across * down * (colour == 0 ? pixel.r : colour == 1 ? pixel.g : pixel.b);
    }
  }
  return sum / ((x1 - x0) * (y1 - y0));
}

TEST(Enlarge, GivesTheMeanOfWhatEachPixelCovers) {
  const Image<Rgb> image = noise(13, 7);
  for (const auto& [width, height] : {std::pair{13, 7}, {26, 14}, {14, 8}, {29, 7}, {13, 20}, {61, 45}, {1000, 9}}) {
    const Image<Rgb> large = enlarge(image, width, height);
    ASSERT_EQ(large.width(), width);
    ASSERT_EQ(large.height(), height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Rgb pixel = large(x, y);
        ASSERT_NEAR(pixel.r, covered_mean(image, x, y, width, height, 0), 1.6) << width << " " << x << " " << y;
        ASSERT_NEAR(pixel.g, covered_mean(image, x, y, width, height, 1), 1.6) << width << " " << x << " " << y;
        ASSERT_NEAR(pixel.b, covered_mean(image, x, y, width, height, 2), 1.6) << width << " " << x << " " << y;
      }
    }
  }
  EXPECT_EQ(enlarge(Image<Rgb>(1, 1, {1, 2, 3}), 5, 3)(4, 2), (Rgb{1, 2, 3}));
}

TEST(Enlarge, WholeFactorsRepeatPixels) {
  const Image<Rgb> image = noise(5, 4), large = enlarge(image, 15, 12);
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 15; ++x) ASSERT_EQ(large(x, y), image(x / 3, y / 3));
  }
}

TEST(Yuv, IsThatOfBt601) {
  const int width = 34, height = 22;
  const Image<Rgb> image = noise(width, height);
  const std::ptrdiff_t stride = 40;
  std::vector<std::uint8_t> y(stride * height, 1), u(stride * height / 2, 1), v(stride * height / 2, 1);
  to_yuv420(image, {y.data(), stride}, {u.data(), stride}, {v.data(), stride});
  const double kr = 0.299, kb = 0.114, kg = 1 - kr - kb;
  for (int row = 0; row < height; row += 2) {
    for (int column = 0; column < width; column += 2) {
      double sum_u = 0, sum_v = 0;
      for (int i = 0; i < 4; ++i) {
        const int x = column + i % 2, at = row + i / 2;
        const Rgb pixel = image(x, at);
        const double luma = (kr * pixel.r + kg * pixel.g + kb * pixel.b) / 255;
        ASSERT_NEAR(y[static_cast<std::size_t>(at * stride + x)], 16 + 219 * luma, 0.51);
        sum_u += 128 + 224 * (pixel.b / 255.0 - luma) / (2 * (1 - kb));
        sum_v += 128 + 224 * (pixel.r / 255.0 - luma) / (2 * (1 - kr));
      }
      const auto index = static_cast<std::size_t>(row / 2 * stride + column / 2);
      ASSERT_NEAR(u[index], sum_u / 4, 0.51);
      ASSERT_NEAR(v[index], sum_v / 4, 0.51);
    }
  }
  EXPECT_EQ(y[width], 1) << "pixels after the row are unchanged";
  EXPECT_EQ(u[width / 2], 1);
  for (const Rgb grey : {Rgb{0, 0, 0}, Rgb{255, 255, 255}, Rgb{77, 77, 77}}) {
    to_yuv420(Image<Rgb>(2, 2, grey), {y.data(), stride}, {u.data(), stride}, {v.data(), stride});
    EXPECT_EQ(u[0], 128);
    EXPECT_EQ(v[0], 128);
    EXPECT_EQ(y[0], std::lround(16 + 219.0 * grey.r / 255));
  }
}

}  // namespace
}  // namespace esim
