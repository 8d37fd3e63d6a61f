#include "esim/scene/images/texture.h"

#include <bit>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace esim::inline scene {
namespace {

/// Clamps light to finite numbers >= 0; NaN becomes 0.
float valid_light(float light) { return light > 0 ? std::min(light, std::numeric_limits<float>::max()) : 0.0F; }

/// The power of two that no texel exceeds.
float scale_for(float brightest) {
  if (!(brightest > 0)) return 1;
  int exponent = 0;
  const float mantissa = std::frexp(brightest, &exponent);
  return std::ldexp(1.0F, mantissa > 0.5F ? std::min(exponent, 127) : exponent - 1);
}

}  // namespace

Texture::Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v) : wrap_u_(wrap_u), wrap_v_(wrap_v) {
  cv::Mat level(texels.height(), texels.width(), CV_32F);
  float brightest = 0;
  std::transform(texels.pixels().begin(), texels.pixels().end(), level.begin<float>(), [&](float light) {
    light = valid_light(light);
    brightest = std::max(brightest, light);
    return light;
  });
  scale_ = scale_for(brightest);

  while (true) {
    const auto index = static_cast<unsigned>(levels_++);
    const int width = level.cols, height = level.rows;
    level_offset_[index] = static_cast<std::int32_t>(codes_.size() * sizeof(codes_[0]));
    level_stride_[index] = static_cast<std::int32_t>((width + 1) * sizeof(codes_[0]));
    level_width_[index] = static_cast<float>(width);
    level_height_[index] = static_cast<float>(height);
    for (int y = 0; y <= height; ++y) {
      const float* const row = level.ptr<float>(y < height ? y : wrap_v == Wrap::repeat ? 0 : height - 1);
      for (int x = 0; x < width; ++x) codes_.push_back(encode(row[x]));
      codes_.push_back(encode(row[wrap_u == Wrap::repeat ? 0 : width - 1]));
    }
    if ((width == 1 && height == 1) || levels_ == kMaxLevels) break;

    // Each coarser texel is the exact mean over its area, also if the size is odd.
    cv::Mat coarser;
    cv::resize(level, coarser, {std::max(1, width / 2), std::max(1, height / 2)}, 0, 0, cv::INTER_AREA);
    level = coarser;
  }
}

std::uint16_t Texture::encode(float value) const {
  constexpr std::uint32_t kHalfStep = 1U << (kCodeShift - 1);
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value / scale_) + kHalfStep;
  if (bits < kCodeBias) return 0;
  return static_cast<std::uint16_t>(std::min((bits - kCodeBias) >> kCodeShift, 0xffffU));
}

Image<float> Texture::texels() const {
  Image<float> image(width(), height());
  for (int y = 0; y < height(); ++y) {
    for (int x = 0; x < width(); ++x) {
      const std::uint32_t code =
          codes_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width() + 1) + static_cast<std::size_t>(x)];
      image(x, y) = scale_ * std::bit_cast<float>((code << kCodeShift) + kCodeBias);
    }
  }
  return image;
}

}  // namespace esim::inline scene
