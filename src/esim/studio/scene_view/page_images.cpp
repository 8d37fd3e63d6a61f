#include "esim/studio/scene_view/page_images.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "esim/core/colour/srgb.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/preview/pictures.h"
#include "esim/scene/images/image_header.h"

namespace esim::studio {
namespace {

constexpr int kLongest = 2048;  // px

Image<float> at_most(const Image<float>& image, int longest) {
  const int side = std::max(image.width(), image.height());
  if (side <= longest) return image;
  const auto scaled = [&](int px) { return std::max(1, static_cast<int>(std::int64_t{px} * longest / side)); };
  return reduce_mean(image, scaled(image.width()), scaled(image.height()));
}

std::string jpeg_of(const ImagePixels& rgb) {
  constexpr int kQuality = 90;
  return encode_jpeg(
      {.data = rgb.bytes.data(), .row_bytes = rgb.row_bytes, .width = rgb.width, .height = rgb.height, .channels = 3},
      kQuality);
}

std::string_view bytes_of(const CodedTexture& texture) {
  return {reinterpret_cast<const char*>(texture.bytes.data()), texture.bytes.size()};
}

std::size_t big_endian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::size_t value = 0;
  for (std::size_t i = at; i < at + count && i < bytes.size(); ++i)
    value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

bool is_jpeg(std::string_view bytes) { return bytes.starts_with("\xff\xd8\xff"); }

/// Whether a JPEG is complete, grey or of three colours, and without an EXIF rotation, which esim ignores.
bool is_plain_jpeg(std::string_view bytes) {
  if (!is_jpeg(bytes) || bytes.find("\xff\xd9") == std::string_view::npos) return false;
  for (std::size_t at = 2; at + 10 < bytes.size() && bytes[at] == '\xff';) {
    const auto marker = static_cast<unsigned char>(bytes[at + 1]);
    constexpr unsigned kApp1 = 0xe1, kHuffman = 0xc4, kScan = 0xda;
    if (marker == kApp1 && bytes.substr(at + 4, 4) == "Exif") return false;
    if (marker == kScan) return false;
    if ((marker & 0xf0U) == 0xc0 && marker != kHuffman) {
      const std::size_t channels = big_endian(bytes, at + 9, 1);
      return channels == 1 || channels == 3;
    }
    at += 2 + big_endian(bytes, at + 2, 2);
  }
  return false;
}

/// The image without transparency.
bool is_plain_png(std::string_view bytes) {
  constexpr std::size_t kHead = 8, kColourType = 25, kAlpha = 4;
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n") || (big_endian(bytes, kColourType, 1) & kAlpha) != 0) return false;
  for (std::size_t at = kHead; at + kHead < bytes.size();) {
    const std::string_view kind = bytes.substr(at + 4, 4);
    if (kind == "tRNS") return false;
    if (kind == "IDAT") return true;
    at += 12 + big_endian(bytes, at, 4);
  }
  return false;
}

std::optional<int> longest_side(const CodedTexture& texture) {
  const auto size = size_in_header(texture.bytes);
  return size ? std::optional(static_cast<int>(std::min<std::int64_t>(std::max(size->width, size->height), 1 << 20)))
              : std::nullopt;
}

/// A JPEG decoded at reduced size (down to one eighth), which is fast; empty if this is not possible.
std::optional<ImagePixels> reduced(const CodedTexture& texture, int longest) {
  constexpr int kMaxSide = 8192, kFinest = 2;
  const std::optional<int> side = longest_side(texture);
  if (!is_plain_jpeg(bytes_of(texture)) || !side || *side > kMaxSide || *side < kFinest * longest) return std::nullopt;
  const int times = *side / longest;
  ImagePixels pixels;
  if (!decode_reduced_jpeg(texture.bytes, times >= 8 ? 8 : times >= 4 ? 4 : 2, pixels)) return std::nullopt;
  return pixels;
}

}  // namespace

PageImage page_image(const CodedTexture& texture) {
  const std::string_view bytes = bytes_of(texture);
  const std::optional<int> side = longest_side(texture);
  if (side && *side <= kLongest) {
    if (is_plain_jpeg(bytes)) return {"image/jpeg", std::string(bytes)};
    if (is_plain_png(bytes)) return {"image/png", std::string(bytes)};
  }
  return {"image/jpeg", make_jpeg(decoded(texture, true), kLongest)};
}

Thumbnail thumbnail(const CodedTexture& texture, int longest) {
  if (const auto rgb = reduced(texture, longest)) return {jpeg_of(*rgb), false};
  const Planes planes = decoded(texture, true);
  return {make_jpeg(planes, longest), std::max(planes.front().width(), planes.front().height()) <= longest};
}

PageLight page_light(const Planes& linear, int longest) {
  constexpr float kGreatest = 65504;
  Planes reduced;
  for (const Image<float>& plane : linear) reduced.push_back(at_most(plane, longest));
  PageLight light{reduced.front().width(), reduced.front().height(), {}};
  light.halves.reserve(2 * 3 * reduced.front().size());
  for (std::size_t i = 0; i < reduced.front().size(); ++i) {
    for (const std::size_t colour : {std::size_t{0}, reduced.size() / 2, reduced.size() - 1}) {
      const Eigen::half value(std::clamp(reduced[colour].pixels()[i], 0.0F, kGreatest));
      const auto bits = Eigen::numext::bit_cast<std::uint16_t>(value);
      light.halves += static_cast<char>(bits & 0xffU), light.halves += static_cast<char>(bits >> 8U);
    }
  }
  return light;
}

std::string make_jpeg(const Planes& linear, int longest) {
  std::vector<Image<std::uint8_t>> channels;
  for (const Image<float>& plane : linear) channels.push_back(encode_srgb(at_most(plane, longest)));
  const Image<std::uint8_t>&red = channels.front(), &green = channels[channels.size() / 2], &blue = channels.back();
  ImagePixels rgb;
  rgb.resize(red.width(), red.height(), 3, 8);
  for (int y = 0; y < red.height(); ++y) {
    std::uint8_t* out = rgb.row(y);
    for (int x = 0; x < red.width(); ++x) {
      *out++ = red(x, y);
      *out++ = green(x, y);
      *out++ = blue(x, y);
    }
  }
  return jpeg_of(rgb);
}

}  // namespace esim::studio
