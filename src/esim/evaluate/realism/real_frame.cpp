#include "esim/evaluate/realism/real_frame.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "esim/core/error.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/files/input_file.h"

namespace esim::inline evaluate {
namespace {

namespace fs = std::filesystem;

constexpr double kDarkest = 2.0 / 255;

/// Grey values from 0 to 1 of the sensor's part of a picture.
Image<float> read_frame(const fs::path& path, int width, int height) {
  ImagePixels pixels;
  InputFile file(path);
  if (!decode_image(file.read_exactly(file.size(), "the image"), pixels) || pixels.bits != 8)
    throw UserError(path.string() + ": must be a PNG image of 8 bits");
  const int top = pixels.height >= 2 * height ? height : 0;
  if (pixels.width < width || pixels.height < height) {
    throw UserError(fmt::format("{}: {} x {} px is less than the sensor of {} x {} px", path.string(), pixels.width,
                                pixels.height, width, height));
  }
  Image<float> frame(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* const row = pixels.row(top + y);
    for (int x = 0; x < width; ++x) {
      const std::uint8_t* const p = row + static_cast<std::ptrdiff_t>(x) * pixels.channels;
      const float grey = pixels.channels < 3 ? static_cast<float>(p[0])
                                             : 0.299F * static_cast<float>(p[0]) + 0.587F * static_cast<float>(p[1]) +
                                                   0.114F * static_cast<float>(p[2]);
      frame(x, y) = grey / 255;
    }
  }
  return frame;
}

/// Replaces rows and columns at the border that are black by those beside them.
void replace_black_border(Image<float>& frame) {
  const int width = frame.width(), height = frame.height();
  const auto is_black = [&](int x0, int y0, int dx, int dy, int n) {
    for (int k = 0; k < n; ++k)
      if (frame(x0 + k * dx, y0 + k * dy) > 0) return false;
    return true;
  };
  int left = 0, right = width - 1, top = 0, bottom = height - 1;
  while (top < bottom && is_black(0, top, 1, 0, width)) ++top;
  while (top < bottom && is_black(0, bottom, 1, 0, width)) --bottom;
  while (left < right && is_black(left, 0, 0, 1, height)) ++left;
  while (left < right && is_black(right, 0, 0, 1, height)) --right;
  const Image<float> given = frame;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) frame(x, y) = given(std::clamp(x, left, right), std::clamp(y, top, bottom));
  }
}

/// The standard deviation of noise, from the medians of a second difference that lines and slopes hardly change
/// (Immerkaer, Computer Vision and Image Understanding 64, 1996, with the median instead of the mean).
double noise_of(const Image<float>& image) {
  std::vector<double> differences;
  for (int y = 1; y + 1 < image.height(); ++y) {
    for (int x = 1; x + 1 < image.width(); ++x) {
      double sum = 0;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i)
          sum += (3 * std::abs(i) - 2) * (3 * std::abs(j) - 2) * static_cast<double>(image(x + i, y + j));
      }
      differences.push_back(std::abs(sum));
    }
  }
  if (differences.empty()) return 0;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return *middle / (0.6745 * 6);
}

/// A bilateral filter; the border repeats.
Image<float> without_noise(const Image<float>& image) {
  constexpr int kReach = 5;
  constexpr double kWidth_px = 2.5, kNoises = 3;
  const double range = kNoises * noise_of(image);
  if (range <= 0) return image;
  Image<float> result(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      double sum = 0, weights = 0;
      for (int j = -kReach; j <= kReach; ++j) {
        for (int i = -kReach; i <= kReach; ++i) {
          const float value = image(std::clamp(x + i, 0, image.width() - 1), std::clamp(y + j, 0, image.height() - 1));
          const double difference = static_cast<double>(value - image(x, y)) / range;
          const double weight = std::exp(-0.5 * ((i * i + j * j) / (kWidth_px * kWidth_px) + difference * difference));
          sum += weight * static_cast<double>(value), weights += weight;
        }
      }
      result(x, y) = static_cast<float>(sum / weights);
    }
  }
  return result;
}

/// Gradual changes of brightness: the exponential of a quadratic polynomial of the position, 1 in the middle.
Image<float> vignetting_of(const Image<float>& frame) {
  constexpr int kSteps = 30, kTerms = 6;
  constexpr double kUsual = 0.1;  // deviations of the logarithm above this count less
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  const auto terms_at = [&](int x, int y) {
    const double u = 2.0 * x / frame.width() - 1, v = 2.0 * y / frame.height() - 1;
    return (Terms() << 1, u, v, u * u, u * v, v * v).finished();
  };
  Terms polynomial = Terms::Zero();
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    Terms right = Terms::Zero();
    for (int y = 0; y < frame.height(); ++y) {
      for (int x = 0; x < frame.width(); ++x) {
        const Terms terms = terms_at(x, y);
        const double value = std::log(static_cast<double>(frame(x, y))),
                     residual = step == 0 ? 0 : (value - terms.dot(polynomial)) / kUsual,
                     weight = 1 / (1 + residual * residual);
        normal += weight * terms * terms.transpose(), right += weight * value * terms;
      }
    }
    polynomial = normal.ldlt().solve(right);
  }
  polynomial[0] = 0;
  Image<float> factors(frame.width(), frame.height());
  for (int y = 0; y < frame.height(); ++y) {
    for (int x = 0; x < frame.width(); ++x)
      factors(x, y) = static_cast<float>(std::exp(terms_at(x, y).dot(polynomial)));
  }
  return factors;
}

}  // namespace

RealFrame read_real_frame(const fs::path& path, int width, int height) {
  Image<float> frame = read_frame(path, width, height);
  replace_black_border(frame);
  const auto raise = [](Image<float>& image) {
    for (float& value : image.pixels()) value = std::max(value, static_cast<float>(kDarkest));
  };
  raise(frame);
  RealFrame real{{}, vignetting_of(frame)};
  for (std::size_t i = 0; i < frame.size(); ++i) frame.pixels()[i] /= real.vignetting.pixels()[i];
  real.scene = without_noise(frame);
  raise(real.scene);
  return real;
}

}  // namespace esim::inline evaluate
