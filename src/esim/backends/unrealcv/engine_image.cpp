#include "esim/backends/unrealcv/engine_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>

#include "esim/core/engine_error.h"
#include "esim/files/npy_header.h"
#include "esim/scene/images/image_file.h"
#include "esim/scene/images/image_header.h"

namespace esim::inline backends::inline unrealcv {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are read in the byte order of the machine");

/// An array of H x W x channels numbers, borrowed.
struct NpyImage {
  int width = 0, height = 0;
  std::size_t channels = 1;
  char kind = 0;  ///< u, i or f
  std::size_t bytes = 0;
  std::string_view numbers;

  template <typename Number>
  Number at(std::size_t index) const {
    Number number;
    std::memcpy(&number, numbers.data() + index * sizeof(Number), sizeof(Number));
    return number;
  }
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

void require(const ImageExtent& expected, std::uint64_t width, std::uint64_t height) {
  const bool same =
      width == static_cast<std::uint64_t>(expected.width) && height == static_cast<std::uint64_t>(expected.height);
  if (!same) throw OtherSize{width, height};
}

NpyImage parse_npy(std::string_view body, const ImageExtent& expected) {
  std::string_view rest = body;
  const auto read = [&rest](std::span<std::byte> out) {
    const std::string_view next = rest.substr(0, out.size());
    rest.remove_prefix(next.size());
    std::copy(next.begin(), next.end(), reinterpret_cast<char*>(out.data()));
    return next.size();
  };
  const npy::Header header = npy::read_header(
      read, [](const std::string& problem) { throw EngineError("is not a usable array: " + problem); });
  if (header.fortran_order) throw EngineError("is an array in Fortran order, which is not supported");
  NpyImage image;
  const std::string& type = header.descr.text;
  const std::vector<std::uint64_t>& shape = header.shape;
  const bool readable = type.size() == 3 && (type[0] == '<' || type[0] == '|' || type[0] == '=') &&
                        std::strchr("uif", type[1]) != nullptr && std::strchr("1248", type[2]) != nullptr;
  if (!readable) throw EngineError("contains numbers of type " + type + ", which are not supported");
  if (shape.size() < 2 || shape.size() > 3 || (shape.size() == 3 && (shape[2] < 1 || shape[2] > 4)))
    throw EngineError("is not an array of height x width, or of height x width x channels");
  require(expected, shape[1], shape[0]);
  image.width = expected.width, image.height = expected.height;
  image.channels = shape.size() == 3 ? static_cast<std::size_t>(shape[2]) : 1;
  image.kind = type[1];
  image.bytes = static_cast<std::size_t>(type[2] - '0');
  image.numbers = rest;
  if (image.numbers.size() < image.pixels() * image.channels * image.bytes) throw EngineError("is cut off");
  return image;
}

template <typename T>
void make_room(const ImageExtent& extent, Image<T>& image) {
  if (image.width() != extent.width || image.height() != extent.height) image = Image<T>(extent.width, extent.height);
}

[[noreturn]] void fail_at(const NpyImage& image, std::size_t pixel, const std::string& what) {
  const auto width = static_cast<std::size_t>(image.width);
  throw EngineError(what + " (first in column " + std::to_string(pixel % width) + ", row " +
                    std::to_string(pixel / width) + ")");
}

void light_of_floats(const NpyImage& image, Image<float>& irradiance) {
  float* const out = irradiance.data();
  const auto take = [&](auto light_at) {
    for (std::size_t i = 0; i < image.pixels(); ++i) {
      const float light = light_at(i * image.channels);
      if (!(std::fabs(light) <= std::numeric_limits<float>::max()))
        fail_at(image, i, "has light values that are not finite");
      out[i] = std::max(0.0F, light);
    }
  };
  const auto number = [&](std::size_t index) {
    return image.bytes == 4 ? image.at<float>(index) : static_cast<float>(image.at<double>(index));
  };
  if (image.channels < 3) return take(number);
  take([&](std::size_t index) { return luminance(number(index), number(index + 1), number(index + 2)); });
}

void light_of_bytes(const NpyImage& image, Image<float>& irradiance) {
  Planes planes(1);
  std::swap(planes[0], irradiance);
  decode({.data = image.numbers.data(),
          .row_bytes = static_cast<std::ptrdiff_t>(static_cast<std::size_t>(image.width) * image.channels),
          .width = image.width,
          .height = image.height,
          .channels = static_cast<int>(image.channels),
          .opaque = true},
         Encoding::srgb, false, planes);
  std::swap(planes[0], irradiance);
}

/// Decodes a PNG image of the expected size.
void decode_png(std::string_view body, const ImageExtent& expected, Encoding encoding, bool colour, Planes& planes) {
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(body.data()), body.size());
  const auto size = size_in_header(bytes);
  if (!size) throw EngineError("is cut off");
  require(expected, static_cast<std::uint64_t>(size->width), static_cast<std::uint64_t>(size->height));
  try {
    decode_planes(bytes, "in the answer", encoding, colour, planes);
  } catch (const UserError&) {
    throw EngineError("cannot be decoded: it is damaged");
  }
}

[[noreturn]] void refuse(std::string_view body) {
  std::string beginning;
  for (const char c : body.substr(0, 60)) beginning += c >= ' ' && c < 127 ? c : '?';
  throw EngineError("is not an image, but '" + beginning + "'");
}

std::uint32_t code_at(const NpyImage& image, std::size_t pixel) {
  const std::size_t index = pixel * image.channels;
  if (image.channels >= 3) {
    const auto code = [&](std::size_t channel) { return std::uint32_t{image.at<unsigned char>(index + channel)}; };
    return code(0) | code(1) << 8 | code(2) << 16;
  }
  switch (image.bytes) {
    case 1:
      return image.at<std::uint8_t>(index);
    case 2:
      return image.at<std::uint16_t>(index);
    case 4:
      return image.at<std::uint32_t>(index);
    default:
      return static_cast<std::uint32_t>(image.at<std::uint64_t>(index));
  }
}

}  // namespace

bool is_npy(std::string_view body) { return body.starts_with(npy::kMagic); }
bool is_png(std::string_view body) { return body.starts_with("\x89PNG"); }

void decode_light(std::string_view body, ImageExtent expected, Image<float>& irradiance) {
  if (is_png(body)) {
    Planes planes(1);
    std::swap(planes[0], irradiance);
    decode_png(body, expected, Encoding::srgb, false, planes);
    std::swap(planes[0], irradiance);
    return;
  }
  if (!is_npy(body)) refuse(body);
  const NpyImage image = parse_npy(body, expected);
  make_room(expected, irradiance);
  if (image.kind == 'f' && image.bytes >= 4) return light_of_floats(image, irradiance);
  if (image.kind != 'u' || image.bytes != 1)
    throw EngineError("must contain light as 8-bit integers, or as 32- or 64-bit floating-point numbers");
  light_of_bytes(image, irradiance);
}

void decode_depth(std::string_view body, ImageExtent expected, Image<float>& depth) {
  if (!is_npy(body)) refuse(body);
  const NpyImage image = parse_npy(body, expected);
  if (image.kind != 'f' || image.bytes < 4)
    throw EngineError("must contain depth as 32- or 64-bit floating-point numbers");
  make_room(expected, depth);
  float* const out = depth.data();
  for (std::size_t i = 0; i < image.pixels(); ++i) {
    const std::size_t index = i * image.channels;
    const float z = image.bytes == 4 ? image.at<float>(index) : static_cast<float>(image.at<double>(index));
    if (!(z >= 0)) fail_at(image, i, "has depths that are negative or not numbers");
    out[i] = z;
  }
}

void decode_mask(std::string_view body, ImageExtent expected, const std::vector<std::uint32_t>& codes,
                 Image<std::uint16_t>& object) {
  make_room(expected, object);
  std::uint32_t last_code = 0;
  std::uint16_t last = 0;
  const auto number_of = [&](std::uint32_t code) {
    if (code != last_code || last == 0) {
      const auto found = std::find(codes.begin(), codes.end(), code);
      last = static_cast<std::uint16_t>(found == codes.end() ? 0 : found - codes.begin() + 1);
      last_code = code;
    }
    return last;
  };
  if (is_png(body)) {
    Planes planes;
    decode_png(body, expected, Encoding::linear, true, planes);
    const auto byte = [](float value) { return static_cast<std::uint32_t>(std::lround(255.0F * value)); };
    for (std::size_t i = 0; i < object.size(); ++i) {
      object.data()[i] =
          number_of(byte(planes[0].data()[i]) | byte(planes[1].data()[i]) << 8 | byte(planes[2].data()[i]) << 16);
    }
    return;
  }
  if (!is_npy(body)) refuse(body);
  const NpyImage image = parse_npy(body, expected);
  if (image.kind == 'f' || (image.channels >= 3 && image.bytes != 1))
    throw EngineError("must contain integers, or colours with 8 bits per channel");
  for (std::size_t i = 0; i < object.size(); ++i) object.data()[i] = number_of(code_at(image, i));
}

std::uint32_t colour_code(std::string_view text) {
  std::uint32_t code = 0;
  std::size_t at = 0;
  for (int channel = 0; channel < 3; ++channel) {
    at = text.find_first_of("0123456789", at);
    if (at == std::string_view::npos) throw EngineError("is not a colour");
    std::uint32_t value = 0;
    while (at < text.size() && text[at] >= '0' && text[at] <= '9' && value < 256)
      value = 10 * value + static_cast<std::uint32_t>(text[at++] - '0');
    if (value > 255) throw EngineError("is not a colour");
    code |= value << 8 * channel;
  }
  return code;
}

}  // namespace esim::inline backends::inline unrealcv
