#include "esim/record/formats/dataset/png_bytes.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace esim {
namespace {

constexpr std::size_t kHeadBytes = 24;  // signature, length and name of the first chunk, then width and height
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;
constexpr std::uint64_t kMostPixelsPerByte = 8'300;  // deflate's 1032 times, of eight one-bit pixels each

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = (value << 8) | static_cast<std::uint8_t>(byte);
  return value;
}

}  // namespace

std::string encode_png(const Image<std::uint16_t>& image, int bits) {
  cv::Mat numbers(image.height(), image.width(), CV_16UC1);
  std::copy_n(image.data(), image.size(), numbers.ptr<std::uint16_t>());
  if (bits <= 8) numbers.convertTo(numbers, CV_8U);
  std::vector<unsigned char> png;
  cv::imencode(".png", numbers, png);
  return {png.begin(), png.end()};
}

std::optional<GreyPng> decode_png(std::string_view bytes) {
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n") || bytes.size() < kHeadBytes) return std::nullopt;
  const std::uint64_t width = big_endian(bytes.substr(16, 4)), height = big_endian(bytes.substr(20, 4));
  const std::uint64_t most = std::min(kMostPixels, bytes.size() * kMostPixelsPerByte);
  if (width == 0 || height == 0 || width > most || height > most / width) return std::nullopt;

  const cv::Mat packed(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
  cv::Mat image;
  try {
    image = cv::imdecode(packed, cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  if (image.empty()) return std::nullopt;
  GreyPng png{image.depth() == CV_16U ? 16 : 8, Image<std::uint16_t>(image.cols, image.rows)};
  image.convertTo(image, CV_16U);
  std::copy_n(image.ptr<std::uint16_t>(), png.image.size(), png.image.data());
  return png;
}

}  // namespace esim
