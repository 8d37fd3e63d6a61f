#include "esim/formats/images/png_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <vector>

#include "esim/files/input_file.h"
#include "esim/files/output_file.h"
#include "esim/files/png_pixels.h"

namespace esim::inline formats {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;

template <typename T>
cv::Mat copy_of(const Image<T>& image, int type) {
  cv::Mat copy(image.height(), image.width(), type);
  std::copy_n(image.data(), image.size(), copy.ptr<T>());
  return copy;
}

cv::Mat demosaicked(const cv::Mat& mosaic) {
  // At the border, OpenCV copies the result one pixel further inside. Mirroring keeps the colour of each pixel.
  constexpr int kBorder = 2;
  cv::Mat wide, colours;
  cv::copyMakeBorder(mosaic, wide, kBorder, kBorder, kBorder, kBorder, cv::BORDER_REFLECT_101);
  cv::cvtColor(wide, colours,
               cv::COLOR_BayerBG2BGR_EA);  // OpenCV names the pattern by the second row, from its second column on
  return colours({kBorder, kBorder, mosaic.cols, mosaic.rows});
}

// OpenCV's default compression is its fastest: gradients and runs, which suit simulated images. With an explicit level,
// OpenCV tries all filters, for twice the time and larger files.
std::string encode(const cv::Mat& image) {
  std::vector<unsigned char> png;
  cv::imencode(".png", image, png);
  return {png.begin(), png.end()};
}

void write(const std::filesystem::path& path, const cv::Mat& image) {
  OutputFile file(path);
  file.append(encode(image));
  file.flush();
}

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

/// Why the bytes are not a PNG, or why its stated size is impossible; empty: no problem.
std::string problem_of(std::string_view bytes) {
  constexpr std::size_t kHeadBytes = 24;  // signature, then the IHDR chunk: length, name, width, height
  constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;
  constexpr std::uint64_t kMaxPixelsPerByte =
      8'300;  // deflate's maximum ratio of 1032, with eight one-bit pixels per byte
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n")) return "it is not a PNG image";
  if (bytes.size() < kHeadBytes || bytes.substr(12, 4) != "IHDR") return "the header is damaged or truncated";
  const std::uint64_t width = big_endian(bytes.substr(16, 4)), height = big_endian(bytes.substr(20, 4));
  const std::uint64_t max = std::min(kMaxPixels, bytes.size() * kMaxPixelsPerByte);
  if (width > 0 && height > 0 && width <= max && height <= max / width) return "";
  return fmt::format("the file is damaged: {} x {} px in {} bytes", width, height, bytes.size());
}

/// Empty if it is damaged.
cv::Mat decode(std::string_view bytes, int mode) {
  thread_local PngPixels png;
  const bool decoded = decode_png_pixels(std::as_bytes(std::span(bytes)), png);
  if (decoded && (png.channels == 1 || (png.channels == 3 && mode == cv::IMREAD_UNCHANGED))) {
    const cv::Mat pixels(png.height, png.width, CV_MAKETYPE(png.bits == 8 ? CV_8U : CV_16U, png.channels),
                         png.bytes.data(), png.row_bytes);
    if (png.channels == 1) return pixels.clone();
    cv::Mat blue_first;
    cv::cvtColor(pixels, blue_first, cv::COLOR_RGB2BGR);
    return blue_first;
  }
  const cv::Mat coded(1, static_cast<int>(bytes.size()), CV_8U, const_cast<char*>(bytes.data()));
  try {
    return cv::imdecode(coded, mode);
  } catch (const cv::Exception&) {
    return {};
  }
}

PngImage to_png_image(cv::Mat image) {
  PngImage result{image.depth() == CV_16U ? 16 : 8, {}};
  image.convertTo(image, CV_16U);
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  std::reverse(channels.begin(), channels.end());  // OpenCV stores blue first
  for (const cv::Mat& channel : channels) {
    result.channels.emplace_back(channel.cols, channel.rows);
    std::copy_n(channel.ptr<std::uint16_t>(), channel.total(), result.channels.back().data());
  }
  return result;
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
  if (file.size() > kMaxFileBytes)
    file.fail(0, fmt::format("the file is too large for an image: {} bytes", file.size()));
  const auto content = file.read(kMaxFileBytes);
  const std::string_view bytes(reinterpret_cast<const char*>(content.data()), content.size());
  if (const std::string problem = problem_of(bytes); !problem.empty()) file.fail(0, problem);
  const cv::Mat image = decode(bytes, cv::IMREAD_UNCHANGED);
  if (image.empty()) file.fail(0, "it cannot be decoded: it is truncated or damaged");
  if (image.channels() != 1 && image.channels() != 3)
    file.fail(0, fmt::format("it has {} channels, not 1 or 3", image.channels()));
  return to_png_image(image);
}

std::string encode_png(const Image<std::uint16_t>& image, int bits) {
  cv::Mat numbers = copy_of(image, CV_16UC1);
  if (bits <= 8) numbers.convertTo(numbers, CV_8U);
  return encode(numbers);
}

std::optional<PngImage> decode_grey_png(std::string_view bytes) {
  if (!problem_of(bytes).empty()) return std::nullopt;
  const cv::Mat image = decode(bytes, cv::IMREAD_ANYDEPTH | cv::IMREAD_GRAYSCALE);
  if (image.empty()) return std::nullopt;
  return to_png_image(image);
}

}  // namespace esim::inline formats
