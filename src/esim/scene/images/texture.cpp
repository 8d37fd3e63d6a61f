#include "esim/scene/images/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
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

/// The texel that continues a row or column of `size` texels at position i.
int continued(int i, int size, Wrap wrap) {
  return wrap == Wrap::clamp ? std::clamp(i, 0, size - 1) : (i % size + size) % size;
}

}  // namespace

Texture::Texture(const Image<float>& texels, Wrap wrap_u, Wrap wrap_v) : wrap_u_(wrap_u), wrap_v_(wrap_v) {
  std::vector<cv::Mat> levels{cv::Mat(texels.height(), texels.width(), CV_32F)};
  float brightest = 0;
  std::transform(texels.pixels().begin(), texels.pixels().end(), levels[0].begin<float>(), [&](float light) {
    light = valid_light(light);
    brightest = std::max(brightest, light);
    return light;
  });
  scale_ = scale_for(brightest);
  // Enough for all levels: together, they have twice the area of the first, and 3.4 times its sides.
  constexpr std::size_t kBeyond = kBefore + kAfter;
  const std::size_t sides = static_cast<std::size_t>(texels.width()) + static_cast<std::size_t>(texels.height());
  codes_.reserve(2 * texels.size() + 4 * kBeyond * sides + kMaxLevels * kBeyond * kBeyond);

  // The square width, in texels of the level, over which the texels of each level average those of the first.
  std::array<float, kMaxLevels> averaged{};
  for (unsigned level = 0;; ++level) {
    if (level == 1) {
      levels.push_back(reduced(levels[0]));
      averaged[1] = (2 + kReduction2) / 2;
    } else if (level > 1) {
      // Each coarser texel is the exact mean over its area, also if the size is odd.
      const cv::Mat& finer = levels[level - 2];
      cv::Mat coarser;
      cv::resize(finer, coarser, {std::max(1, finer.cols / 2), std::max(1, finer.rows / 2)}, 0, 0, cv::INTER_AREA);
      levels.push_back(coarser);
      averaged[level] = 0.25F * averaged[level - 2] + 0.75F;
    }
    // The bilinear interpolation has the square width 2. That of the first level belongs to the image.
    constexpr float kInterpolation = 2;
    level_blur_[level] = averaged[level] + kInterpolation * (1 - std::ldexp(1.0F, -static_cast<int>(level)));
    append(levels[level]);
    if (levels[level].total() == 1 || levels_ == kMaxLevels) break;
    if (level > 1) levels[level - 2].release();
  }
}

/// Stores the next level with its continuations.
void Texture::append(const cv::Mat& level) {
  const auto index = static_cast<unsigned>(levels_++);
  const int width = level.cols, height = level.rows, stride = kBefore + width + kAfter;
  level_offset_[index] = static_cast<std::int32_t>(codes_.size() * sizeof(codes_[0]));
  level_stride_[index] = static_cast<std::int32_t>(static_cast<std::size_t>(stride) * sizeof(codes_[0]));
  level_width_[index] = static_cast<float>(width), level_height_[index] = static_cast<float>(height);
  const float reduction_u = level_width_[index] / level_width_[0],
              reduction_v = level_height_[index] / level_height_[0];
  level_squared_u_[index] = reduction_u * reduction_u, level_squared_v_[index] = reduction_v * reduction_v;
  for (int y = -kBefore; y < height + kAfter; ++y) {
    const float* const row = level.ptr<float>(continued(y, height, wrap_v_));
    const std::size_t first = codes_.size();
    codes_.resize(first + static_cast<std::size_t>(stride));
    std::uint16_t* const codes = &codes_[first + kBefore];
    for (int x = 0; x < width; ++x) codes[x] = encode(row[x]);
    for (int x = -kBefore; x < 0; ++x) codes[x] = codes[continued(x, width, wrap_u_)];
    for (int x = width; x < width + kAfter; ++x) codes[x] = codes[continued(x, width, wrap_u_)];
  }
}

/// An image whose sides are shorter by sqrt(2), by the weights of a footprint of that width.
cv::Mat Texture::reduced(const cv::Mat& image) const {
  const hwy::HWY_NAMESPACE::CappedTag<float, 1> d;
  namespace hn = hwy::HWY_NAMESPACE;
  const BoxFilter filter(d, hn::Set(d, kReduction2), hn::Zero(d));
  const auto shorter = [](int size) { return std::max(1, static_cast<int>(std::lround(size / std::numbers::sqrt2))); };
  // Calls take(i, j, weight) for each texel j of which texel i of the result is a mean.
  const auto reduce = [&](int from, int to, Wrap wrap, const auto& take) {
    for (int i = 0; i < to; ++i) {
      const float x = (static_cast<float>(i) + 0.5F) * static_cast<float>(from) / static_cast<float>(to) - 0.5F;
      const float floor = std::floor(x);
      const auto w = filter.weights(hn::Set(d, x - floor));
      const std::array<float, 4> weight{hn::GetLane(w.first), hn::GetLane(w.second), hn::GetLane(w.third),
                                        hn::GetLane(w.fourth)};
      for (int tap = 0; tap < 4; ++tap)
        take(i, continued(static_cast<int>(floor) - 1 + tap, from, wrap), weight[static_cast<std::size_t>(tap)]);
    }
  };
  cv::Mat lower = cv::Mat::zeros(shorter(image.rows), image.cols, CV_32F);
  reduce(image.rows, lower.rows, wrap_v_, [&](int to, int from, float weight) {
    float* const sum = lower.ptr<float>(to);
    const float* const row = image.ptr<float>(from);
    for (int x = 0; x < image.cols; ++x) sum[x] += weight * row[x];
  });
  struct Share {
    int to, from;
    float weight;
  };
  std::vector<Share> shares;
  reduce(image.cols, shorter(image.cols), wrap_u_, [&](int to, int from, float weight) {
    shares.push_back({to, from, weight});
  });
  cv::Mat reduced = cv::Mat::zeros(lower.rows, shorter(image.cols), CV_32F);
  for (int y = 0; y < reduced.rows; ++y) {
    float* const sums = reduced.ptr<float>(y);
    const float* const row = lower.ptr<float>(y);
    for (const Share& share : shares) sums[share.to] += share.weight * row[share.from];
  }
  return reduced;
}

std::uint16_t Texture::encode(float value) const {
  constexpr std::uint32_t kHalfStep = 1U << (kCodeShift - 1);
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value / scale_) + kHalfStep;
  if (bits < kCodeBias) return 0;
  return static_cast<std::uint16_t>(std::min((bits - kCodeBias) >> kCodeShift, 0xffffU));
}

Image<float> Texture::texels() const {
  Image<float> image(width(), height());
  const auto stride = static_cast<std::size_t>(level_stride_[0]) / sizeof(codes_[0]);
  for (int y = 0; y < height(); ++y) {
    for (int x = 0; x < width(); ++x) {
      const std::uint32_t code =
          codes_[static_cast<std::size_t>(y + kBefore) * stride + static_cast<std::size_t>(x + kBefore)];
      image(x, y) = scale_ * std::bit_cast<float>((code << kCodeShift) + kCodeBias);
    }
  }
  return image;
}

}  // namespace esim::inline scene
