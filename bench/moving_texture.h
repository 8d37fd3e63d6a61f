#pragma once

#include <cmath>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "esim/core/image.h"

namespace esim::bench {

/// Benchmark frames: a log-normal texture with an amplitude spectrum 1/f^1.2 and a lens blur of 0.8 px, on (0, 1], that
/// moves to the right by 0.5 px per frame. Made on a grid of half pixels and averaged 2 x 2, so that no interpolation
/// is involved.
inline std::vector<Image<float>> moving_texture(int width, int height, int count) {
  const int grid_width = cv::getOptimalDFTSize(2 * width + count), grid_height = cv::getOptimalDFTSize(2 * height);
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  cv::Mat noise(grid_height, grid_width, CV_32F);
  for (int y = 0; y < grid_height; ++y) {
    for (int x = 0; x < grid_width; ++x) noise.at<float>(y, x) = normal(random);
  }

  // Shape the spectrum.
  cv::Mat spectrum;
  cv::dft(noise, spectrum, cv::DFT_COMPLEX_OUTPUT);
  for (int y = 0; y < grid_height; ++y) {
    for (int x = 0; x < grid_width; ++x) {
      const double fx = std::min(x, grid_width - x) / static_cast<double>(grid_width);
      const double fy = std::min(y, grid_height - y) / static_cast<double>(grid_height);
      const double f = std::hypot(fx, fy), blur = 3.14159265 * 2 * 0.8 * f;
      const double gain = f > 0 ? std::pow(std::max(f, 1.0 / 512), -1.2) * std::exp(-2 * blur * blur) : 0.0;
      spectrum.at<cv::Vec2f>(y, x) *= static_cast<float>(gain);
    }
  }
  cv::Mat texture;
  cv::dft(spectrum, texture, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  cv::Scalar mean, deviation;
  cv::meanStdDev(texture, mean, deviation);
  texture *= 0.6 / deviation[0];
  cv::max(texture, -1.8, texture);
  cv::min(texture, 1.8, texture);
  texture -= 1.8;
  cv::exp(texture, texture);

  std::vector<Image<float>> frames;
  for (int k = 0; k < count; ++k) {
    Image<float>& frame = frames.emplace_back(width, height);
    for (int y = 0; y < height; ++y) {
      const float *const upper = texture.ptr<float>(2 * y) + k, *const lower = texture.ptr<float>(2 * y + 1) + k;
      for (int x = 0; x < width; ++x)
        frame(x, y) = 0.25F * (upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1]);
    }
  }
  return frames;
}

}  // namespace esim::bench
