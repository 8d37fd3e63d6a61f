#include "esim/event_camera/center_surround.h"

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "esim/core/error.h"

namespace esim::inline event_camera {
namespace {

cv::Mat view(Image<float>& image) { return {image.height(), image.width(), CV_32F, image.data()}; }

}  // namespace

CenterSurround::CenterSurround(double reach_px, double tau_s, int width, int height)
    : tau_s_(tau_s), wave_(width, height), surround_(width, height), next_(width, height) {
  if (width % 2 != 0 || height % 2 != 0)
    throw UserError("event camera: surround_px: the image must have an even number of columns and rows, not " +
                    std::to_string(width) + " x " + std::to_string(height));
  const auto eigenvalue = [](int i, int n) { return 2.0 - 2.0 * std::cos(std::numbers::pi * i / n); };
  gain_.reserve(wave_.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double k2 = eigenvalue(x, width) + eigenvalue(y, height);
      gain_.push_back(static_cast<float>(1.0 / (1.0 + reach_px * reach_px * k2)));
    }
  }
}

void CenterSurround::open(Image<float>& brightness) {
  cv::dct(view(brightness), view(wave_));
  for (std::size_t i = 0; i < gain_.size(); ++i) surround_.data()[i] = gain_[i] * wave_.data()[i];
  subtract(brightness);
}

void CenterSurround::advance(Image<float>& brightness, double duration_s) {
  cv::dct(view(brightness), view(next_));
  for (std::size_t i = 0; i < gain_.size(); ++i) {
    const float gain = gain_[i];
    float &h = surround_.data()[i], &before = wave_.data()[i];
    const float after = next_.data()[i];
    const double phase = tau_s_ > 0 ? duration_s / (tau_s_ * gain) : 1e9;
    const double moved = -std::expm1(-phase);
    h += static_cast<float>(moved * (gain * before - h) + (1.0 - moved / phase) * gain * (after - before));
    before = after;
  }
  subtract(brightness);
}

void CenterSurround::subtract(Image<float>& brightness) {
  cv::idct(view(surround_), view(next_));
  for (std::size_t i = 0; i < gain_.size(); ++i) brightness.data()[i] -= next_.data()[i];
}

}  // namespace esim::inline event_camera
