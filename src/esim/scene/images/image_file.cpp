#include "esim/scene/images/image_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>
#include <vector>

#include "esim/core/error.h"
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

/// Whether a JPEG file has an end-of-image marker near its end. The decoder silently fills missing parts with grey.
bool is_whole_jpeg(const std::filesystem::path& path) {
  constexpr std::streamoff kTailBytes = 1 << 16;  // cameras append their own data
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - kTailBytes));
  const std::string tail{std::istreambuf_iterator<char>(file), {}};
  return tail.find("\xff\xd9") != std::string::npos;
}

/// Rejects an image by the size in its header, before a decoder allocates memory for it.
void check_header(const std::filesystem::path& path, std::span<const std::byte> head, std::uintmax_t bytes) {
  if (const auto size = size_in_header(head)) check_claim(path, size->width, size->height, bytes);
}

void check_header(const std::filesystem::path& path) {
  std::vector<std::byte> head(kImageHeadBytes);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  check_header(path, std::span(head).first(static_cast<std::size_t>(file.gcount())), size_of(path));
}

PixelType pixel_type(const std::filesystem::path& path, const cv::Mat& image) {
  switch (image.depth()) {
    case CV_8U:
      return PixelType::uint8;
    case CV_16U:
      return PixelType::uint16;
    case CV_32F:
      return PixelType::float32;
    default:
      fail(path, "has an unsupported pixel type; convert it to 8 or 16 bit, EXR or HDR");
  }
}

/// The encoded pixel values of a file that is not OpenEXR. `read` decodes it with OpenCV.
template <typename Read>
cv::Mat read_pixels(const std::filesystem::path& path, const Read& read) {
  cv::Mat image;
  try {
    image = read();
  } catch (const cv::Exception& exception) {
    fail(path, "cannot be decoded: " + exception.err);
  }
  if (image.empty()) fail(path, "cannot be decoded; it must be a complete PNG, JPEG, TIFF, EXR or HDR image");
  check_size(path, image.cols, image.rows);
  return image;
}

void decode_pixels(const std::filesystem::path& path, const cv::Mat& image, Encoding encoding, bool colour,
                   Planes& planes) {
  decode({.data = image.data,
          .row_bytes = static_cast<std::ptrdiff_t>(image.step[0]),
          .width = image.cols,
          .height = image.rows,
          .channels = image.channels(),
          .blue_first = true,
          .type = pixel_type(path, image)},
         encoding, colour, planes);
}

/// The pixels as an opaque image, whatever their alpha.
CodedImage coded_image(const PngPixels& png) {
  return {.data = png.bytes.data(),
          .row_bytes = static_cast<std::ptrdiff_t>(png.row_bytes),
          .width = png.width,
          .height = png.height,
          .channels = png.channels,
          .opaque = true,
          .type = png.bits == 8 ? PixelType::uint8 : PixelType::uint16};
}

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

/// As above, for a file on disk.
cv::Mat read_pixels(const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  if ((extension == ".jpg" || extension == ".jpeg") && !is_whole_jpeg(path)) {
    fail(path, "is not a JPEG image, or is cut off");
  }
  check_header(path);
  return read_pixels(path, [&] { return cv::imread(path.string(), cv::IMREAD_UNCHANGED); });
}

void require_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) fail(path, "no such file");
}

constexpr const char* kMedianNeedsBytes =
    "does not have 8 bits per channel, which the median filter requires; remove the median";

/// Applies a filter with a radius of `reach` pixels; `around`: across the left and right edge.
template <typename Filter>
void apply(cv::Mat& image, int reach, bool around, const Filter& filter) {
  if (!around) return filter(image);
  cv::Mat wide;
  cv::copyMakeBorder(image, wide, 0, 0, reach, reach, cv::BORDER_WRAP);
  filter(wide);
  wide.colRange(reach, reach + image.cols).copyTo(image);
}

void take_median(const std::filesystem::path& path, const Softening& softening, cv::Mat& image) {
  const int side = softening.median_px;
  if (side <= 1) return;
  if (side % 2 == 0) fail(path, fmt::format("the width of the median must be an odd number of pixels, not {}", side));
  if (image.depth() != CV_8U) fail(path, kMedianNeedsBytes);
  apply(image, side / 2, softening.around, [&](cv::Mat& pixels) { cv::medianBlur(pixels, pixels, side); });
}

/// Decoding composites `coded` over white, light + (1 - alpha); this subtracts the white.
void separate_alpha(const cv::Mat& coded, TranslucentImage& image) {
  image.alpha = Image<float>(coded.cols, coded.rows);
  cv::Mat channel, alpha(coded.rows, coded.cols, CV_32F, image.alpha.data());
  cv::extractChannel(coded, channel, 3);
  channel.convertTo(alpha, CV_32F, coded.depth() == CV_8U ? 1.0 / 255 : 1.0 / 65535);
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
  cv::Mat pixels;
};

Decoded load_after_median(const std::filesystem::path& path, const Softening& softening, bool colour) {
  require_file(path);
  Decoded result;
  if (lower_case_extension(path) == ".exr") {
    if (softening.median_px > 1) fail(path, kMedianNeedsBytes);
    load_exr(path, Encoding::automatic, colour, result.planes);
  } else {
    result.pixels = read_pixels(path);
    take_median(path, softening, result.pixels);
    decode_pixels(path, result.pixels, Encoding::automatic, colour, result.planes);
  }
  return result;
}

}  // namespace

void load_planes(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes) {
  require_file(path);
  if (lower_case_extension(path) == ".exr") return load_exr(path, encoding, colour, planes);
  decode_pixels(path, read_pixels(path), encoding, colour, planes);
}

void decode_planes(std::span<const std::byte> content, const std::string& name, Encoding encoding, bool colour,
                   Planes& planes) {
  constexpr std::size_t kTailBytes = std::size_t{1} << 16;
  check_header(name, content, content.size());
  const std::string_view text(reinterpret_cast<const char*>(content.data()), content.size());
  const std::string_view tail = text.substr(text.size() - std::min(text.size(), kTailBytes));
  if (text.starts_with("\xff\xd8") && tail.find("\xff\xd9") == std::string_view::npos) fail(name, "is cut off");
  if (content.size() > std::numeric_limits<int>::max()) fail(name, "is larger than 2 GiB");

  thread_local PngPixels png;
  if (decode_png_pixels(content, png)) {
    check_size(name, png.width, png.height);
    return decode(coded_image(png), encoding, colour, planes);
  }
  const cv::Mat coded(1, static_cast<int>(content.size()), CV_8U, const_cast<std::byte*>(content.data()));
  cv::Mat image = read_pixels(name, [&] { return cv::imdecode(coded, cv::IMREAD_UNCHANGED); });
  if (image.channels() == 4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  decode_pixels(name, image, encoding, colour, planes);
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
  auto [planes, pixels] = load_after_median(path, softening, false);
  TranslucentImage result{std::move(planes.front()), {}};
  if (pixels.channels() == 4 && pixels.depth() != CV_32F) separate_alpha(pixels, result);
  blur(softening, result.light);
  blur(softening, result.alpha);
  return result;
}

}  // namespace esim::inline scene
