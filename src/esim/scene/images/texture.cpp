#include "esim/scene/images/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>

#include "esim/core/error.h"

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
  std::size_t enough = 0;  // for all levels
  const double largest = std::max(texels.width(), texels.height());
  for (double reduction = 1; reduction < std::numbers::sqrt2 * largest; reduction *= std::numbers::sqrt2) {
    const auto reduced_side = [&](int side) { return static_cast<int>(std::ceil(side / reduction)); };
    enough += codes(reduced_side(texels.width()), reduced_side(texels.height())) + kBlockBytes / 2;
  }
  if (enough > std::numeric_limits<std::int32_t>::max() / sizeof(codes_[0])) {
    throw UserError("a texture of " + std::to_string(texels.width()) + " x " + std::to_string(texels.height()) +
                    " px takes more than 2 GiB of memory; make its longer side shorter");
  }
  codes_.reserve(enough);

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

/// How many blocks of this width (height) the columns (rows) of taps need.
int Texture::blocks(int texels, int block) { return (texels + kBefore) / (block - kOverlap) + 1; }

/// The size of a level: of the last block, only the rows in use.
std::size_t Texture::codes(int width, int height) {
  const int columns = blocks(width, kBlockWidth), rows = blocks(height, kBlockHeight);
  const int last = kBefore + height + kAfter - (rows - 1) * (kBlockHeight - kOverlap);
  return (static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) - 1) * (kBlockWidth * kBlockHeight) +
         static_cast<std::size_t>(last) * kBlockWidth;
}

/// Stores the next level with its continuations.
void Texture::append(const cv::Mat& level) {
  constexpr std::size_t kCodes = kBlockBytes / sizeof(codes_[0]);  // of a block
  const auto index = static_cast<unsigned>(levels_++);
  const int width = level.cols, height = level.rows;
  const int columns = blocks(width, kBlockWidth), rows = blocks(height, kBlockHeight);
  const std::size_t needed = codes(width, height);
  // Blocks begin with pages.
  const std::size_t begin = needed > kCodes ? (codes_.size() + kCodes - 1) / kCodes * kCodes : codes_.size();
  codes_.resize(begin + needed);
  level_offset_[index] = static_cast<std::int32_t>(begin * sizeof(codes_[0]));
  level_stride_[index] = columns * kBlockBytes;
  level_width_[index] = static_cast<float>(width), level_height_[index] = static_cast<float>(height);
  const float reduction_u = level_width_[index] / level_width_[0],
              reduction_v = level_height_[index] / level_height_[0];
  level_squared_u_[index] = reduction_u * reduction_u, level_squared_v_[index] = reduction_v * reduction_v;

  std::vector<std::uint16_t> line(static_cast<std::size_t>(columns * (kBlockWidth - kOverlap) + kOverlap));
  for (int block_row = 0; block_row < rows; ++block_row) {
    const int first = block_row * (kBlockHeight - kOverlap);
    for (int k = 0; k < std::min(kBlockHeight, kBefore + height + kAfter - first); ++k) {
      const float* const row = level.ptr<float>(continued(first + k - kBefore, height, wrap_v_));
      for (int x = 0; x < width; ++x) line[static_cast<std::size_t>(kBefore + x)] = encode(row[x]);
      const auto copy = [&](int x) {
        line[static_cast<std::size_t>(kBefore + x)] =
            line[static_cast<std::size_t>(kBefore + continued(x, width, wrap_u_))];
      };
      for (int x = -kBefore; x < 0; ++x) copy(x);
      for (int x = width; x < static_cast<int>(line.size()) - kBefore; ++x) copy(x);
      for (int block = 0; block < columns; ++block) {
        const auto blocks_before = static_cast<std::size_t>(block_row * columns + block);
        std::copy_n(line.begin() + block * (kBlockWidth - kOverlap), kBlockWidth,
                    codes_.begin() + static_cast<std::ptrdiff_t>(begin + blocks_before * kCodes) + k * kBlockWidth);
      }
    }
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
  const hwy::HWY_NAMESPACE::CappedTag<float, 1> d;
  namespace hn = hwy::HWY_NAMESPACE;
  const auto level = grid(d, hn::Zero(hn::RebindToSigned<decltype(d)>()));
  for (int y = 0; y < height(); ++y) {
    for (int x = 0; x < width(); ++x) {
      const auto column = hn::Set(d, static_cast<float>(x + kBefore)),
                 row = hn::Set(d, static_cast<float>(y + kBefore));
      const std::uint32_t code = codes_[static_cast<std::size_t>(hn::GetLane(position(d, column, row, level))) / 2];
      image(x, y) = scale_ * std::bit_cast<float>((code << kCodeShift) + kCodeBias);
    }
  }
  return image;
}

}  // namespace esim::inline scene
