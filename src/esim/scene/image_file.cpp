#include "esim/scene/image_file.h"

#include <ImfArray.h>
#include <ImfRgbaFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr std::size_t kMaxPixels = std::size_t{1} << 28;

float luminance(float red, float green, float blue) { return 0.2126F * red + 0.7152F * green + 0.0722F * blue; }

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
  throw UserError(fmt::format("image {}: {}", path.string(), reason));
}

void check_size(const std::filesystem::path& path, std::int64_t width, std::int64_t height) {
  if (width < 1 || height < 1 || static_cast<double>(width) * static_cast<double>(height) > double{kMaxPixels}) {
    fail(path, fmt::format("{}x{} pixels are not supported (at most 2^28)", width, height));
  }
}

Image<float> load_exr(const std::filesystem::path& path) {
  try {
    Imf::RgbaInputFile file(path.c_str());
    const auto window = file.dataWindow();
    const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
    const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
    check_size(path, width, height);
    Imf::Array2D<Imf::Rgba> pixels(height, width);
    file.setFrameBuffer(&pixels[0][0] - window.min.x - window.min.y * width, 1, static_cast<std::size_t>(width));
    file.readPixels(window.min.y, window.max.y);

    Image<float> out(static_cast<int>(width), static_cast<int>(height));
    for (int y = 0; y < out.height(); ++y) {
      for (int x = 0; x < out.width(); ++x) {
        const Imf::Rgba& p = pixels[y][x];
        out(x, y) = luminance(p.r, p.g, p.b);
      }
    }
    return out;
  } catch (const UserError&) {
    throw;
  } catch (const std::exception& error) {
    fail(path, std::string("cannot be read: ") + error.what());
  }
}

/// One luminance from the channels of a pixel, each mapped by `linear`; OpenCV's order is B, G, R, A.
template <typename T, typename Linear>
float pixel_luminance(const T* channel, int channels, float full_scale, const Linear& linear) {
  if (channels < 3) {
    const float grey = linear(channel[0]);
    if (channels == 1) return grey;
    const float alpha = static_cast<float>(channel[1]) / full_scale;
    return alpha * grey + (1.0F - alpha);
  }
  const float colour = luminance(linear(channel[2]), linear(channel[1]), linear(channel[0]));
  if (channels == 3) return colour;
  const float alpha = static_cast<float>(channel[3]) / full_scale;
  return alpha * colour + (1.0F - alpha);
}

template <typename T, typename Linear>
Image<float> convert(const cv::Mat& image, float full_scale, const Linear& linear) {
  Image<float> out(image.cols, image.rows);
  const int channels = image.channels();
  for (int y = 0; y < out.height(); ++y) {
    const T* row = image.ptr<T>(y);
    for (int x = 0; x < out.width(); ++x) {
      out(x, y) = pixel_luminance(row + std::ptrdiff_t{x} * channels, channels, full_scale, linear);
    }
  }
  return out;
}

/// Linear values of every code of an integer image.
std::vector<float> srgb_table(int codes) {
  std::vector<float> table(static_cast<std::size_t>(codes));
  for (int i = 0; i < codes; ++i) {
    table[static_cast<std::size_t>(i)] = linear_from_srgb(static_cast<float>(i) / static_cast<float>(codes - 1));
  }
  return table;
}

}  // namespace

float linear_from_srgb(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

Image<float> load_luminance(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) fail(path, "no such file");
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".exr") return load_exr(path);

  cv::Mat image;
  try {
    image = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& exception) {
    fail(path, "cannot be decoded: " + exception.err);
  }
  if (image.empty()) fail(path, "cannot be decoded; is it a PNG, JPEG, TIFF, EXR or HDR image, and complete?");
  check_size(path, image.cols, image.rows);

  switch (image.depth()) {
    case CV_8U: {
      const auto table = srgb_table(256);
      return convert<std::uint8_t>(image, 255.0F, [&](std::uint8_t code) { return table[code]; });
    }
    case CV_16U: {
      const auto table = srgb_table(65536);
      return convert<std::uint16_t>(image, 65535.0F, [&](std::uint16_t code) { return table[code]; });
    }
    case CV_32F:
      return convert<float>(image, 1.0F, [](float value) { return value; });
    default:
      fail(path, "has an unsupported pixel type; convert it to 8 or 16 bit, EXR or HDR");
  }
}

}  // namespace esim
