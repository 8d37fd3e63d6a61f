#include "esim/record/formats/png_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "esim/record/input_file.h"
#include "esim/record/output_file.h"

namespace esim {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;

// OpenCV's own way of compressing, the fastest that it has: gradients and runs, which are what simulated images have.
// Where it is told how hard to try, it tries everything, for twice the time and larger files.
void write(const std::filesystem::path& path, const cv::Mat& image) {
  std::vector<unsigned char> png;
  cv::imencode(".png", image, png);
  OutputFile file(path);
  file.append({reinterpret_cast<const char*>(png.data()), png.size()});
  file.flush();
}

template <typename T>
cv::Mat copy_of(const Image<T>& image, int type) {
  cv::Mat copy(image.height(), image.width(), type);
  std::copy_n(image.data(), image.size(), copy.ptr<T>());
  return copy;
}

cv::Mat demosaicked(const cv::Mat& mosaic) {
  // At the border OpenCV takes what is one pixel further in. Mirroring keeps each pixel's colour.
  constexpr int kBorder = 2;
  cv::Mat wide, colours;
  cv::copyMakeBorder(mosaic, wide, kBorder, kBorder, kBorder, kBorder, cv::BORDER_REFLECT_101);
  cv::cvtColor(wide, colours, cv::COLOR_BayerBG2BGR_EA);  // named after the second row, from its second column on
  return colours({kBorder, kBorder, mosaic.cols, mosaic.rows});
}

/// Refuses a PNG by the size that it says it has: no compression saves more than deflate's factor of about 1000.
void require_credible_size(InputFile& file) {
  constexpr std::size_t kHeadBytes = 24;  // signature, then the IHDR chunk: length, name, width, height
  constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28, kMaxPixelsPerByte = 10'000;  // 1 bit each at least
  const auto head = file.read_exactly(kHeadBytes, "the header");
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (!text.starts_with("\x89PNG\r\n\x1a\n") || text.substr(12, 4) != "IHDR") file.fail(0, "it is not a PNG image");
  const auto big_endian = [&head](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::uint64_t>(head[at + i]);
    return value;
  };
  const std::uint64_t width = big_endian(16), height = big_endian(20);
  if (width == 0 || height == 0 || width > kMaxPixels || height > kMaxPixels || width * height > kMaxPixels ||
      width * height > kMaxPixelsPerByte * file.size() || file.size() > kMaxFileBytes) {
    file.fail(16, fmt::format("{} x {} px in {} bytes: it is damaged", width, height, file.size()));
  }
  file.seek(0);
}

}  // namespace

void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& image) {
  write(path, copy_of(image, CV_8UC1));
}

void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& image) {
  write(path, copy_of(image, CV_16UC1));
}

void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint8_t>& mosaic) {
  write(path, demosaicked(copy_of(mosaic, CV_8UC1)));
}

void write_demosaicked_png(const std::filesystem::path& path, const Image<std::uint16_t>& mosaic) {
  write(path, demosaicked(copy_of(mosaic, CV_16UC1)));
}

void write_png(const std::filesystem::path& path, const PerColour<Image<std::uint16_t>>& channels) {
  const auto& [red, green, blue] = channels;
  cv::Mat image;
  cv::merge(std::vector{copy_of(blue, CV_16UC1), copy_of(green, CV_16UC1), copy_of(red, CV_16UC1)}, image);
  write(path, image);
}

PngImage read_png(const std::filesystem::path& path) {
  InputFile file(path);
  require_credible_size(file);
  const auto bytes = file.read(kMaxFileBytes);
  const cv::Mat coded(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data()));
  cv::Mat image;
  try {
    image = cv::imdecode(coded, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {  // the same as an empty image
  }
  if (image.empty()) file.fail(0, "it cannot be decoded: cut off, or damaged");
  if (image.channels() != 1 && image.channels() != 3)
    file.fail(0, fmt::format("it has {} channels, not 1 or 3", image.channels()));

  PngImage result{image.depth() == CV_16U ? 16 : 8, {}};
  image.convertTo(image, CV_16U);
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  std::reverse(channels.begin(), channels.end());  // blue is first
  for (const cv::Mat& channel : channels) {
    result.channels.emplace_back(channel.cols, channel.rows);
    std::copy_n(channel.ptr<std::uint16_t>(), channel.total(), result.channels.back().data());
  }
  return result;
}

}  // namespace esim
