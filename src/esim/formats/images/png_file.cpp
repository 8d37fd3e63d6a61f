#include "esim/formats/images/png_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <span>
#include <vector>

#include "esim/files/codecs/image_codecs.h"
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
               cv::COLOR_BayerBG2RGB_EA);  // OpenCV names the pattern by the second row, from its second column on
  return colours({kBorder, kBorder, mosaic.cols, mosaic.rows});
}

std::string encode(const cv::Mat& image) {
  return encode_png({.data = image.data,
                     .row_bytes = image.step[0],
                     .width = image.cols,
                     .height = image.rows,
                     .channels = image.channels(),
                     .bits = image.depth() == CV_16U ? 16 : 8},
                    PngEffort::fast);
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

/// False if it is damaged.
bool decode(std::string_view bytes, ImagePixels& pixels) {
  const auto content = std::as_bytes(std::span(bytes));
  return (decode_png_pixels(content, pixels) && pixels.channels != 2) || decode_image(content, pixels);
}

template <typename Code>
void separate(const ImagePixels& pixels, std::vector<Image<std::uint16_t>>& channels) {
  for (int y = 0; y < pixels.height; ++y) {
    const auto* code = reinterpret_cast<const Code*>(pixels.row(y));
    for (int x = 0; x < pixels.width; ++x) {
      for (Image<std::uint16_t>& channel : channels) channel(x, y) = *code++;
    }
  }
}

PngImage to_png_image(const ImagePixels& pixels) {
  PngImage result{pixels.bits, {}};
  for (int i = 0; i < pixels.channels; ++i) result.channels.emplace_back(pixels.width, pixels.height);
  if (pixels.bits == 16) {
    separate<std::uint16_t>(pixels, result.channels);
  } else {
    separate<std::uint8_t>(pixels, result.channels);
  }
  return result;
}

/// Luma of Rec. 601, rounded as libpng and OpenCV do.
Image<std::uint16_t> grey_of(const PngImage& colours) {
  constexpr std::uint64_t kRed = 9798, kGreen = 19235, kBlue = 3735;  // of 2^15
  const std::uint64_t half = colours.bits == 16 ? 1 << 14 : 0;
  const auto &red = colours.channels[0], &green = colours.channels[1], &blue = colours.channels[2];
  Image<std::uint16_t> grey(red.width(), red.height());
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const std::uint64_t sum = kRed * red.data()[i] + kGreen * green.data()[i] + kBlue * blue.data()[i];
    grey.data()[i] = static_cast<std::uint16_t>((sum + half) >> 15);
  }
  return grey;
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
  cv::merge(std::vector{copy_of(red, CV_16UC1), copy_of(green, CV_16UC1), copy_of(blue, CV_16UC1)}, image);
  write(path, image);
}

PngImage read_png(const std::filesystem::path& path) {
  InputFile file(path);
  if (file.size() > kMaxFileBytes)
    file.fail(0, fmt::format("the file is too large for an image: {} bytes", file.size()));
  const auto content = file.read(kMaxFileBytes);
  const std::string_view bytes(reinterpret_cast<const char*>(content.data()), content.size());
  if (const std::string problem = problem_of(bytes); !problem.empty()) file.fail(0, problem);
  thread_local ImagePixels pixels;
  if (!decode(bytes, pixels)) file.fail(0, "it cannot be decoded: it is truncated or damaged");
  if (pixels.channels != 1 && pixels.channels != 3)
    file.fail(0, fmt::format("it has {} channels, not 1 or 3", pixels.channels));
  return to_png_image(pixels);
}

std::string encode_png(const Image<std::uint16_t>& image, int bits) {
  cv::Mat numbers = copy_of(image, CV_16UC1);
  if (bits <= 8) numbers.convertTo(numbers, CV_8U);
  return encode(numbers);
}

std::optional<PngImage> decode_grey_png(std::string_view bytes) {
  if (!problem_of(bytes).empty()) return std::nullopt;
  thread_local ImagePixels pixels;
  if (!decode(bytes, pixels)) return std::nullopt;
  PngImage image = to_png_image(pixels);
  if (image.channels.size() > 1) image.channels = {grey_of(image)};
  return image;
}

}  // namespace esim::inline formats
