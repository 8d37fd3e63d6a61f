#include "esim/scene/image_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "esim/core/error.h"

namespace esim {
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

/// The channels that hold the colour: R, G, B, or the luminance Y.
std::vector<const char*> colour_channels(const std::filesystem::path& path, const Imf::ChannelList& channels) {
  const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
  if (has("R") && has("G") && has("B")) return {"R", "G", "B"};
  if (has("Y")) return {"Y"};
  fail(path, "has neither the channels R, G, B nor Y; save it with one of these");
}

void read_exr(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes) {
  Imf::InputFile file(path.c_str());
  const auto window = file.header().dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  check_size(path, width, height);
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

/// Whether a JPEG file has an end-of-image mark near its end. The decoder makes grey of what is cut off, and says
/// nothing.
bool is_whole_jpeg(const std::filesystem::path& path) {
  constexpr std::streamoff kTailBytes = 1 << 16;  // cameras append data of their own
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - kTailBytes));
  const std::string tail{std::istreambuf_iterator<char>(file), {}};
  return tail.find("\xff\xd9") != std::string::npos;
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

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

/// Refuses a PNG file by the size in its first chunk, before the decoder takes memory for it.
void check_png_size(const std::filesystem::path& path) {
  std::array<unsigned char, 24> head{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(head.data()), head.size()) || head[0] != 0x89 || head[1] != 'P') return;
  const auto big_endian = [&](std::size_t at) {
    return std::int64_t{head[at]} << 24 | head[at + 1] << 16 | head[at + 2] << 8 | head[at + 3];
  };
  check_size(path, big_endian(16), big_endian(20));
}

/// The pixels of a file that is not OpenEXR, as they are coded.
cv::Mat read_pixels(const std::filesystem::path& path) {
  check_png_size(path);
  const std::string extension = lower_case_extension(path);
  if ((extension == ".jpg" || extension == ".jpeg") && !is_whole_jpeg(path)) {
    fail(path, "is no JPEG image, or is cut off");
  }
  cv::Mat image;
  try {
    image = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& exception) {
    fail(path, "cannot be decoded: " + exception.err);
  }
  if (image.empty()) fail(path, "cannot be decoded; is it a PNG, JPEG, TIFF, EXR or HDR image, and complete?");
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

void require_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) fail(path, "no such file");
}

constexpr const char* kMedianNeedsBytes = "is not of 8 bits, which a median needs; leave the median out";

void take_median(const std::filesystem::path& path, int side, cv::Mat& image) {
  if (side <= 1) return;
  if (side % 2 == 0) fail(path, fmt::format("a median over {} px has no middle; use an odd number", side));
  if (image.depth() != CV_8U) fail(path, kMedianNeedsBytes);
  cv::medianBlur(image, image, side);
}

/// Decoding laid `coded` over white, light + (1 - alpha): takes the white away.
void separate_alpha(const cv::Mat& coded, TranslucentImage& image) {
  image.alpha = Image<float>(coded.cols, coded.rows);
  cv::Mat channel, alpha(coded.rows, coded.cols, CV_32F, image.alpha.data());
  cv::extractChannel(coded, channel, 3);
  channel.convertTo(alpha, CV_32F, coded.depth() == CV_8U ? 1.0 / 255 : 1.0 / 65535);
  for (std::size_t i = 0; i < image.light.size(); ++i) {
    image.light.data()[i] = std::max(0.0F, image.light.data()[i] - (1.0F - image.alpha.data()[i]));
  }
}

void blur(Image<float>& image, double sigma_px) {
  const cv::Mat matrix(image.height(), image.width(), CV_32F, image.data());
  cv::GaussianBlur(matrix, matrix, {0, 0}, sigma_px);
}

}  // namespace

void load_planes(const std::filesystem::path& path, Encoding encoding, bool colour, Planes& planes) {
  require_file(path);
  if (lower_case_extension(path) == ".exr") return load_exr(path, encoding, colour, planes);
  decode_pixels(path, read_pixels(path), encoding, colour, planes);
}

Image<float> load_luminance(const std::filesystem::path& path) {
  Planes planes;
  load_planes(path, Encoding::automatic, false, planes);
  return std::move(planes.front());
}

TranslucentImage load_translucent(const std::filesystem::path& path, const Softening& softening) {
  require_file(path);
  TranslucentImage result;
  if (lower_case_extension(path) == ".exr") {
    if (softening.median_px > 1) fail(path, kMedianNeedsBytes);
    result.light = load_luminance(path);
  } else {
    cv::Mat image = read_pixels(path);
    take_median(path, softening.median_px, image);
    Planes planes;
    decode_pixels(path, image, Encoding::automatic, false, planes);
    result.light = std::move(planes.front());
    if (image.channels() == 4 && image.depth() != CV_32F) separate_alpha(image, result);
  }
  if (softening.gaussian_px > 0) {
    blur(result.light, softening.gaussian_px);
    if (!result.alpha.empty()) blur(result.alpha, softening.gaussian_px);
  }
  return result;
}

}  // namespace esim
