#include "esim/scene/images/image_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/inputs/used_files.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/files/input_file.h"
#include "esim/files/png_pixels.h"
#include "esim/scene/images/image_header.h"

namespace esim::inline scene {
namespace {

constexpr std::size_t kMaxPixels = std::size_t{1} << 28;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
  throw UserError(fmt::format("image {}: {}", path.string(), reason));
}

void check_size(const std::filesystem::path& path, std::int64_t width, std::int64_t height) {
  if (width < 1 || height < 1 || static_cast<double>(width) * static_cast<double>(height) > double{kMaxPixels}) {
    fail(path, fmt::format("{}x{} pixels are not supported (at most 2^28)", width, height));
  }
}

/// Checks the size in a file's header, also against the number of bytes: no compression saves more than this.
void check_claim(const std::filesystem::path& path, std::int64_t width, std::int64_t height, std::uintmax_t bytes) {
  constexpr double kMaxPixelsPerByte = 10'000, kSmall = 1 << 20;
  check_size(path, width, height);
  const double pixels = static_cast<double>(width) * static_cast<double>(height);
  if (pixels > kSmall && pixels > kMaxPixelsPerByte * static_cast<double>(bytes))
    fail(path, fmt::format("its header states {}x{} pixels, but it has only {} bytes; it is cut off or damaged", width,
                           height, bytes));
}

std::uintmax_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  return error ? 0 : bytes;
}

/// The channels with the colour: R, G, B, or the luminance Y.
std::vector<const char*> colour_channels(const std::filesystem::path& path, const Imf::ChannelList& channels) {
  const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
  if (has("R") && has("G") && has("B")) return {"R", "G", "B"};
  if (has("Y")) return {"Y"};
  fail(path, "must have the channels R, G and B, or the channel Y; save it with them");
}

void read_exr(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes) {
  note_used(path);
  Imf::InputFile file(path.c_str());
  const auto window = file.header().dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  check_claim(path, width, height, size_of(path));
  const auto names = colour_channels(path, file.header().channels());
  const std::size_t count = names.size(), pixel_bytes = count * sizeof(float);
  const std::size_t row_bytes = static_cast<std::size_t>(width) * pixel_bytes;

  std::vector<float> pixels(static_cast<std::size_t>(width * height) * count);
  Imf::FrameBuffer buffer;
  for (std::size_t i = 0; i < count; ++i) {
    buffer.insert(names[i], Imf::Slice::Make(Imf::FLOAT, pixels.data() + i, window, pixel_bytes, row_bytes));
  }
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  decode({.data = pixels.data(),
          .row_bytes = static_cast<std::ptrdiff_t>(row_bytes),
          .width = static_cast<int>(width),
          .height = static_cast<int>(height),
          .channels = static_cast<int>(count),
          .type = PixelType::float32},
         encoding, colour, planes);
}

void load_exr(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes) {
  try {
    read_exr(path, encoding, colour, planes);
  } catch (const UserError&) {
    throw;
  } catch (const std::exception& error) {
    fail(path, std::string("cannot be read: ") + error.what());
  }
}

/// Whether a JPEG image has an end-of-image marker near its end. The decoder silently fills missing parts with grey.
bool is_whole_jpeg(std::string_view content) {
  constexpr std::size_t kTailBytes = 1 << 16;  // cameras append their own data
  const std::string_view tail = content.substr(content.size() - std::min(content.size(), kTailBytes));
  return tail.find("\xff\xd9") != std::string_view::npos;
}

bool is_jpeg(std::string_view content) { return content.starts_with("\xff\xd8"); }

std::string_view as_text(std::span<const std::byte> content) {
  return {reinterpret_cast<const char*>(content.data()), content.size()};
}

/// Rejects an image by the size in its header, before a decoder allocates memory for it.
void check_header(const std::filesystem::path& path, std::span<const std::byte> content) {
  if (const auto size = size_in_header(content)) check_claim(path, size->width, size->height, content.size());
}

/// The encoded pixel values of a file that is not OpenEXR.
ImagePixels decode_pixels(const std::filesystem::path& path, std::span<const std::byte> content) {
  check_header(path, content);
  ImagePixels image;
  if (!decode_image(content, image))
    fail(path, fmt::format("cannot be decoded; it must be a complete {} image, or OpenEXR", kImageFormats));
  check_size(path, image.width, image.height);
  return image;
}

/// Of decoded pixels, borrowed.
CodedImage coded_image(const ImagePixels& image) {
  return {.data = image.bytes.data(),
          .row_bytes = static_cast<std::ptrdiff_t>(image.row_bytes),
          .width = image.width,
          .height = image.height,
          .channels = image.channels,
          .type = image.bits == 8    ? PixelType::uint8
                  : image.bits == 16 ? PixelType::uint16
                                     : PixelType::float32};
}

std::vector<std::byte> content_of(const std::filesystem::path& path) {
  std::vector<std::byte> content(size_of(path));
  std::ifstream file = open_input(path);
  file.read(reinterpret_cast<char*>(content.data()), static_cast<std::streamsize>(content.size()));
  if (!file) fail(path, "cannot be read; check its permissions");
  return content;
}

/// The encoded pixel values of a file on disk that is not OpenEXR.
ImagePixels read_pixels(const std::filesystem::path& path) {
  const std::vector<std::byte> content = content_of(path);
  const std::string extension = lower_extension(path);
  const bool should_be_jpeg = extension == ".jpg" || extension == ".jpeg" || is_jpeg(as_text(content));
  if (should_be_jpeg && !is_whole_jpeg(as_text(content))) fail(path, "is not a JPEG image, or is cut off");
  return decode_pixels(path, content);
}

void require_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) fail(path, "no such file");
}

constexpr const char* kMedianNeedsBytes =
    "does not have 8 bits per channel, which the median filter requires; remove the median";

/// The pixels as a matrix, borrowed.
cv::Mat matrix_of(ImagePixels& image) {
  const int depth = image.bits == 8 ? CV_8U : image.bits == 16 ? CV_16U : CV_32F;
  return {image.height, image.width, CV_MAKETYPE(depth, image.channels), image.bytes.data(), image.row_bytes};
}

/// Applies a filter with a radius of `reach` pixels; `around`: across the left and right edge.
template <typename Filter>
void apply(cv::Mat& image, int reach, bool around, const Filter& filter) {
  if (!around) return filter(image);
  cv::Mat wide;
  cv::copyMakeBorder(image, wide, 0, 0, reach, reach, cv::BORDER_WRAP);
  filter(wide);
  wide.colRange(reach, reach + image.cols).copyTo(image);
}

void take_median(const std::filesystem::path& path, const Softening& softening, ImagePixels& image) {
  const int side = softening.median_px;
  if (side <= 1) return;
  if (side % 2 == 0) fail(path, fmt::format("the width of the median must be an odd number of pixels, not {}", side));
  if (image.bits != 8) fail(path, kMedianNeedsBytes);
  cv::Mat matrix = matrix_of(image);
  apply(matrix, side / 2, softening.around, [&](cv::Mat& pixels) { cv::medianBlur(pixels, pixels, side); });
}

/// Decoding composites `coded` over white, light + (1 - alpha); this subtracts the white.
void separate_alpha(ImagePixels& coded, TranslucentImage& image) {
  image.alpha = Image<float>(coded.width, coded.height);
  cv::Mat channel, alpha(coded.height, coded.width, CV_32F, image.alpha.data());
  cv::extractChannel(matrix_of(coded), channel, coded.channels - 1);
  channel.convertTo(alpha, CV_32F, coded.bits == 8 ? 1.0 / 255 : 1.0 / 65535);
  for (std::size_t i = 0; i < image.light.size(); ++i) {
    image.light.data()[i] = std::max(0.0F, image.light.data()[i] - (1.0F - image.alpha.data()[i]));
  }
}

void blur(const Softening& softening, Image<float>& image) {
  const double sigma = softening.gaussian_px;
  if (image.empty() || !(sigma > 0)) return;
  constexpr double kReach = 5;  // standard deviations; OpenCV's kernel is smaller
  cv::Mat matrix(image.height(), image.width(), CV_32F, image.data());
  apply(matrix, static_cast<int>(std::ceil(kReach * sigma)), softening.around, [&](cv::Mat& pixels) {
    cv::GaussianBlur(pixels, pixels, {0, 0}, sigma);
  });
}

/// An image after its median filter, and the pixels from which it was decoded (empty for OpenEXR).
struct Decoded {
  Planes planes;
  ImagePixels pixels;
};

Decoded load_after_median(const std::filesystem::path& path, const Softening& softening, bool colour) {
  require_file(path);
  Decoded result;
  if (lower_extension(path) == ".exr") {
    if (softening.median_px > 1) fail(path, kMedianNeedsBytes);
    load_exr(path, Encoding::automatic, colour, result.planes);
  } else {
    result.pixels = read_pixels(path);
    take_median(path, softening, result.pixels);
    decode(coded_image(result.pixels), Encoding::automatic, colour, result.planes);
  }
  return result;
}

}  // namespace

void load_planes(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes) {
  require_file(path);
  if (lower_extension(path) == ".exr") return load_exr(path, encoding, colour, planes);
  decode(coded_image(read_pixels(path)), encoding, colour, planes);
}

void decode_planes(std::span<const std::byte> content, const std::string& name, Encoding encoding, bool colour,
                   Planes& planes) {
  check_header(name, content);
  if (is_jpeg(as_text(content)) && !is_whole_jpeg(as_text(content))) fail(name, "is cut off");

  thread_local ImagePixels pixels;
  if (decode_png_pixels(content, pixels)) {
    check_size(name, pixels.width, pixels.height);
  } else {
    pixels = decode_pixels(name, content);
  }
  CodedImage coded = coded_image(pixels);
  coded.opaque = true;
  decode(coded, encoding, colour, planes);
}

Image<float> load_luminance(const std::filesystem::path& path, const Softening& softening) {
  Image<float> luminance = std::move(load_after_median(path, softening, false).planes.front());
  blur(softening, luminance);
  return luminance;
}

Planes load_colours(const std::filesystem::path& path, const Softening& softening) {
  Planes planes = load_after_median(path, softening, true).planes;
  for (Image<float>& plane : planes) blur(softening, plane);
  return planes;
}

TranslucentImage load_translucent(const std::filesystem::path& path, const Softening& softening) {
  Decoded decoded = load_after_median(path, softening, false);
  TranslucentImage result{std::move(decoded.planes.front()), {}};
  if (decoded.pixels.channels == 4) separate_alpha(decoded.pixels, result);
  blur(softening, result.light);
  blur(softening, result.alpha);
  return result;
}

}  // namespace esim::inline scene
