#include "esim/preview/pictures.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "esim/files/codecs/image_codecs.h"

namespace esim::inline preview {
namespace {

cv::Mat view(const Image<float>& image) {
  return {image.height(), image.width(), CV_32FC1, const_cast<float*>(image.data())};
}
cv::Mat view(const Image<Rgb>& image) {
  return {image.height(), image.width(), CV_8UC3, const_cast<Rgb*>(image.data())};
}

/// The position of a pixel of an enlarged image along one side of the original: within one pixel, or partly in the
/// next.
struct Source {
  int first = 0, second = 0;
  std::uint16_t of_second = 0;  // weight of the second pixel, out of kWhole
};
constexpr std::uint16_t kWhole = 256;

std::vector<Source> sources(int from, int to) {
  std::vector<Source> all(static_cast<std::size_t>(to));
  const double step = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    const int first = std::min(static_cast<int>(i * step), from - 1);
    const double beyond = ((i + 1) * step - (first + 1)) / step;
    const auto of_second = static_cast<std::uint16_t>(std::lround(kWhole * std::clamp(beyond, 0.0, 1.0)));
    all[static_cast<std::size_t>(i)] = {first, std::min(first + 1, from - 1), of_second};
  }
  return all;
}

std::uint8_t blend(std::uint8_t a, std::uint8_t b, std::uint16_t of_b) {
  return static_cast<std::uint8_t>(static_cast<std::uint16_t>(a * (kWhole - of_b) + b * of_b + kWhole / 2) >> 8);
}

void enlarge_row(const Rgb* row, const std::vector<Source>& columns, Rgb* out) {
  for (const auto& [first, second, of_second] : columns) {
    const Rgb a = row[first], b = row[second];
    *out++ =
        of_second == 0 ? a : Rgb{blend(a.r, b.r, of_second), blend(a.g, b.g, of_second), blend(a.b, b.b, of_second)};
  }
}

}  // namespace

Image<float> reduce_mean(const Image<float>& image, int width, int height) {
  Image<float> out(width, height);
  cv::Mat target = view(out);
  cv::resize(view(image), target, target.size(), 0, 0, cv::INTER_AREA);
  return out;
}

Image<float> reduce_nearest(const Image<float>& image, int width, int height) {
  Image<float> out(width, height);
  for (int y = 0; y < height; ++y) {
    const float* row = image.row((2 * y + 1) * image.height() / (2 * height));
    for (int x = 0; x < width; ++x) out(x, y) = row[(2 * x + 1) * image.width() / (2 * width)];
  }
  return out;
}

std::string encode_png(const Image<Rgb>& image) {
  const PixelView pixels{.data = image.data(),
                         .row_bytes = sizeof(Rgb) * static_cast<std::size_t>(image.width()),
                         .width = image.width(),
                         .height = image.height(),
                         .channels = 3};
  return encode_png(pixels, PngEffort::small);
}

Image<Rgb> enlarge(const Image<Rgb>& image, int width, int height) {
  if (width == image.width() && height == image.height()) return image;
  Image<Rgb> out(width, height);
  if (width < image.width() || height < image.height()) {
    const int factor =
        std::max((width + image.width() - 1) / image.width(), (height + image.height() - 1) / image.height());
    cv::Mat repeated;
    cv::resize(view(image), repeated, {image.width() * factor, image.height() * factor}, 0, 0, cv::INTER_NEAREST);
    cv::Mat target = view(out);
    cv::resize(repeated, target, target.size(), 0, 0, cv::INTER_AREA);
    return out;
  }
  const std::vector<Source> columns = sources(image.width(), width), rows = sources(image.height(), height);
  Image<Rgb> above(width, 1), below(width, 1);  // two rows of the original, enlarged horizontally
  int in_above = -1, in_below = -1;
  for (int y = 0; y < height; ++y) {
    const auto& [first, second, of_second] = rows[static_cast<std::size_t>(y)];
    if (in_above != first && in_below == first) {
      std::swap(above, below);
      std::swap(in_above, in_below);
    }
    if (std::exchange(in_above, first) != first) enlarge_row(image.row(first), columns, above.data());
    if (of_second == 0) {
      std::copy_n(above.data(), width, out.row(y));
      continue;
    }
    if (std::exchange(in_below, second) != second) enlarge_row(image.row(second), columns, below.data());
    const auto* const a = reinterpret_cast<const std::uint8_t*>(above.data());
    const auto* const b = reinterpret_cast<const std::uint8_t*>(below.data());
    auto* const mixed = reinterpret_cast<std::uint8_t*>(out.row(y));
    for (int i = 0; i < 3 * width; ++i) mixed[i] = blend(a[i], b[i], of_second);
  }
  return out;
}

}  // namespace esim::inline preview
