#include "esim/scene/planes.h"

#include <cmath>
#include <cstdint>

namespace esim::inline scene {
namespace {

/// Linear light for every code of an integer image.
template <typename Code>
class CodeTable {
 public:
  static constexpr std::size_t kCodes = std::size_t{1} << (8 * sizeof(Code));

  explicit CodeTable(bool srgb) : light_(kCodes) {
    for (std::size_t code = 0; code < kCodes; ++code) {
      const float value = static_cast<float>(code) / static_cast<float>(kCodes - 1);
      light_[code] = srgb ? linear_from_srgb(value) : value;
    }
  }

  float operator()(Code code) const { return light_[code]; }

  static const CodeTable& of(bool srgb) {
    static const CodeTable kSrgb(true), kLinear(false);
    return srgb ? kSrgb : kLinear;
  }

 private:
  std::vector<float> light_;
};

struct Light {
  float red, green, blue;
};

/// Decodes pixels with kChannels channels.
template <int kChannels, typename T, typename Linear>
Light light_of(const T* channel, bool opaque, float full_scale, const Linear& linear) {
  constexpr bool kGrey = kChannels < 3;
  const float first = linear(channel[0]);
  Light light{first, first, first};
  if constexpr (!kGrey) light = {first, linear(channel[1]), linear(channel[2])};
  if constexpr (kChannels == 2 || kChannels == 4) {
    if (opaque) return light;
    const float alpha = static_cast<float>(channel[kChannels - 1]) / full_scale, white = 1.0F - alpha;
    light = {alpha * light.red + white, alpha * light.green + white, alpha * light.blue + white};
  }
  return light;
}

template <int kChannels, typename T, typename Linear>
void decode_pixels(const CodedImage& image, float full_scale, const Linear& linear, Planes& planes) {
  for (int y = 0; y < image.height; ++y) {
    const T* pixel = reinterpret_cast<const T*>(static_cast<const std::byte*>(image.data) + y * image.row_bytes);
    float* const red = planes[0].row(y);
    float* const green = planes.size() == 1 ? nullptr : planes[1].row(y);
    float* const blue = planes.size() == 1 ? nullptr : planes[2].row(y);
    for (int x = 0; x < image.width; ++x, pixel += kChannels) {
      const Light light = light_of<kChannels>(pixel, image.opaque, full_scale, linear);
      if (green == nullptr) {
        red[x] = luminance(light.red, light.green, light.blue);
      } else {
        red[x] = light.red, green[x] = light.green, blue[x] = light.blue;
      }
    }
  }
}

template <typename T, typename Linear>
void decode_as(const CodedImage& image, float full_scale, const Linear& linear, Planes& planes) {
  switch (image.channels) {
    case 1:
      return decode_pixels<1, T>(image, full_scale, linear, planes);
    case 2:
      return decode_pixels<2, T>(image, full_scale, linear, planes);
    case 3:
      return decode_pixels<3, T>(image, full_scale, linear, planes);
    default:
      return decode_pixels<4, T>(image, full_scale, linear, planes);
  }
}

}  // namespace

float linear_from_srgb(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

float srgb_from_linear(float linear) {
  return linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1 / 2.4F) - 0.055F;
}

void resize(Planes& planes, int width, int height, bool colour) {
  planes.resize(colour ? 3 : 1);
  for (Image<float>& plane : planes) {
    if (plane.width() != width || plane.height() != height) plane = Image<float>(width, height);
  }
}

void decode(const CodedImage& image, Encoding encoding, bool colour, Planes& planes) {
  resize(planes, image.width, image.height, colour);
  switch (image.type) {
    case PixelType::uint8:
      return decode_as<std::uint8_t>(image, 255.0F, CodeTable<std::uint8_t>::of(encoding != Encoding::linear), planes);
    case PixelType::uint16:
      return decode_as<std::uint16_t>(image, 65535.0F, CodeTable<std::uint16_t>::of(encoding != Encoding::linear),
                                      planes);
    case PixelType::float32:
      if (encoding == Encoding::srgb) return decode_as<float>(image, 1.0F, linear_from_srgb, planes);
      return decode_as<float>(
          image, 1.0F, [](float light) { return light; }, planes);
  }
}

}  // namespace esim::inline scene
