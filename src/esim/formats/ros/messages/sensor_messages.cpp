#include "esim/formats/ros/messages/sensor_messages.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace esim::inline formats::ros {
namespace {

constexpr std::uint32_t kMaxMessageExtent = 65536;  // px
constexpr double kRoundingOfNorm = 1e-9;            // rotations within this error of unit norm stay unchanged
constexpr float kMetresPerMillimetre = 1e-3F;

void check_extent(std::uint32_t width, std::uint32_t height) {
  if (width > kMaxMessageExtent || height > kMaxMessageExtent) {
    throw Malformed("an image of " + std::to_string(width) + " x " + std::to_string(height) + " px is too large");
  }
}

/// Reads the rows of an image with so many bytes per pixel.
class Rows {
 public:
  Rows(const ImageMessage& message, std::size_t pixel_bytes) : message_(message) {
    check_extent(message.width, message.height);
    if (pixel_bytes * message.width > message.step ||
        std::uint64_t{message.step} * message.height > message.data.size())
      throw Malformed("an image has fewer bytes than its size requires");
    if (message.is_bigendian != 0 && pixel_bytes == 2) throw Malformed("big-endian images are not supported");
  }

  const std::byte* row(std::uint32_t y) const { return message_.data.data() + std::size_t{y} * message_.step; }

 private:
  const ImageMessage& message_;
};

template <typename T, typename Convert>
void read_pixels(const ImageMessage& message, std::size_t pixel_bytes, Image<T>& image, Convert convert) {
  const Rows rows(message, pixel_bytes);
  const int width = static_cast<int>(message.width), height = static_cast<int>(message.height);
  if (image.width() != width || image.height() != height) image = Image<T>(width, height);
  for (int y = 0; y < height; ++y) {
    const std::byte* from = rows.row(static_cast<std::uint32_t>(y));
    T* const to = image.row(y);
    for (int x = 0; x < width; ++x, from += pixel_bytes) to[x] = convert(from);
  }
}

/// Bytes per pixel of a colour image, and the positions of red and blue; 0: not a colour encoding.
struct Colours {
  std::size_t bytes = 0, red = 0, blue = 0;
};

Colours colours_of(std::string_view encoding) {
  if (encoding == "rgb8") return {3, 0, 2};
  if (encoding == "bgr8" || encoding == "8UC3") return {3, 2, 0};
  if (encoding == "rgba8") return {4, 0, 2};
  if (encoding == "bgra8" || encoding == "8UC4") return {4, 2, 0};
  return {};
}

std::uint16_t luma(unsigned red, unsigned green, unsigned blue) {
  return static_cast<std::uint16_t>((299 * red + 587 * green + 114 * blue + 500) / 1000);  // ITU-R BT.601
}

bool is_bayer(std::string_view encoding, std::string_view bits) {
  return encoding.starts_with("bayer_") && encoding.ends_with(bits);
}

template <typename T>
ImageMessage borrowed(const Image<T>& image, const char* encoding) {
  return {.height = static_cast<std::uint32_t>(image.height()),
          .width = static_cast<std::uint32_t>(image.width()),
          .encoding = encoding,
          .step = static_cast<std::uint32_t>(static_cast<std::size_t>(image.width()) * sizeof(T)),
          .data = std::as_bytes(image.pixels())};
}

struct DistortionMessage {
  std::string model;
  std::vector<double> d;
};

DistortionMessage distortion_message(const Distortion& distortion) {
  if (const auto* d = std::get_if<RadialTangential>(&distortion))
    return {"plumb_bob", {d->k1, d->k2, d->p1, d->p2, d->k3}};
  if (const auto* d = std::get_if<Equidistant>(&distortion)) return {"equidistant", {d->k1, d->k2, d->k3, d->k4}};
  if (const auto* d = std::get_if<Fov>(&distortion)) return {"fov", {d->w}};
  return {"plumb_bob", {0, 0, 0, 0, 0}};
}

std::optional<Distortion> to_distortion(const std::string& model, std::vector<double> d) {
  const bool none = std::all_of(d.begin(), d.end(), [](double value) { return value == 0; });
  const std::size_t given = d.size();
  d.resize(std::max<std::size_t>(given, 5));
  if (model == "equidistant" || model == "fisheye") return Equidistant{d[0], d[1], d[2], d[3]};
  if (model == "fov") return Fov{d[0]};
  if (none) return NoDistortion{};
  if (model == "plumb_bob" && given <= 5) return RadialTangential{d[0], d[1], d[2], d[3], d[4]};
  return std::nullopt;
}

}  // namespace

CameraInfoMessage to_message(const Camera& camera) {
  CameraInfoMessage message;
  message.width = static_cast<std::uint32_t>(camera.width), message.height = static_cast<std::uint32_t>(camera.height);
  auto [model, d] = distortion_message(camera.distortion);
  message.distortion_model = std::move(model), message.d = std::move(d);
  message.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, camera.fx > 0 ? 1.0 : 0.0};
  message.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  message.p = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, message.k[8], 0};
  return message;
}

Camera to_camera(const CameraInfoMessage& message) {
  check_extent(message.width, message.height);
  Camera camera;
  camera.width = static_cast<int>(message.width), camera.height = static_cast<int>(message.height);
  const auto distortion = to_distortion(message.distortion_model, message.d);
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!distortion || !std::all_of(message.k.begin(), message.k.end(), is_finite)) return camera;
  camera.distortion = *distortion;
  camera.fx = message.k[0], camera.cx = message.k[2], camera.fy = message.k[4], camera.cy = message.k[5];
  return camera;
}

ImageMessage to_message(const Image<std::uint16_t>& numbers, int bits, std::vector<std::uint8_t>& buffer) {
  const std::size_t pixel_bytes = bits > 8 ? 2 : 1;
  buffer.resize(numbers.size() * pixel_bytes);
  if (bits > 8) {
    std::memcpy(buffer.data(), numbers.data(), buffer.size());
  } else {
    std::transform(numbers.pixels().begin(), numbers.pixels().end(), buffer.begin(),
                   [](std::uint16_t number) { return static_cast<std::uint8_t>(number); });
  }
  return {.height = static_cast<std::uint32_t>(numbers.height()),
          .width = static_cast<std::uint32_t>(numbers.width()),
          .encoding = bits > 8 ? "mono16" : "mono8",
          .step = static_cast<std::uint32_t>(static_cast<std::size_t>(numbers.width()) * pixel_bytes),
          .data = std::as_bytes(std::span(buffer))};
}

ImageMessage to_message(const Image<std::uint8_t>& image) { return borrowed(image, "mono8"); }

ImageMessage to_message(const Image<float>& image) { return borrowed(image, "32FC1"); }

FlowMessage to_message(const Image<float>& flow_x, const Image<float>& flow_y) {
  return {.height = static_cast<std::uint32_t>(flow_x.height()),
          .width = static_cast<std::uint32_t>(flow_x.width()),
          .flow_x = {std::as_bytes(flow_x.pixels())},
          .flow_y = {std::as_bytes(flow_y.pixels())}};
}

int to_frame(const ImageMessage& message, Image<std::uint16_t>& frame) {
  const std::string& encoding = message.encoding;
  if (encoding == "mono8" || encoding == "8UC1" || is_bayer(encoding, "8")) {
    read_pixels(message, 1, frame, [](const std::byte* at) { return std::to_integer<std::uint16_t>(*at); });
    return 8;
  }
  if (encoding == "mono16" || encoding == "16UC1" || is_bayer(encoding, "16")) {
    read_pixels(message, 2, frame, [](const std::byte* at) { return load_unaligned<std::uint16_t>(at); });
    return 16;
  }
  const Colours colours = colours_of(encoding);
  if (colours.bytes == 0) return 0;
  read_pixels(message, colours.bytes, frame, [&](const std::byte* at) {
    const auto number = [at](std::size_t i) { return std::to_integer<unsigned>(at[i]); };
    return luma(number(colours.red), number(1), number(colours.blue));
  });
  return 8;
}

bool to_floats(const ImageMessage& message, Image<float>& image) {
  if (message.encoding == "32FC1") {
    read_pixels(message, sizeof(float), image, [](const std::byte* at) { return load_unaligned<float>(at); });
    return true;
  }
  if (message.encoding != "16UC1") return false;
  read_pixels(message, 2, image, [](const std::byte* at) {
    return kMetresPerMillimetre * static_cast<float>(load_unaligned<std::uint16_t>(at));
  });
  return true;
}

void to_images(const FlowMessage& message, Image<float>& flow_x, Image<float>& flow_y) {
  check_extent(message.width, message.height);
  const std::uint64_t bytes = std::uint64_t{message.width} * message.height * sizeof(float);
  if (message.flow_x.bytes.size() != bytes || message.flow_y.bytes.size() != bytes)
    throw Malformed("the number of values of a motion field does not match its size");
  const auto fill = [&](Image<float>& image, Bytes from) {
    image = Image<float>(static_cast<int>(message.width), static_cast<int>(message.height));
    if (!from.empty()) std::memcpy(image.data(), from.data(), from.size());
  };
  fill(flow_x, message.flow_x.bytes);
  fill(flow_y, message.flow_y.bytes);
}

SE3 checked_pose(SE3 pose) {
  const double norm = pose.rotation.norm();
  if (!(norm > 0.5 && norm < 2) || !pose.translation.allFinite()) throw Malformed("a pose is invalid");
  if (std::abs(norm - 1) > kRoundingOfNorm) pose.rotation.normalize();
  return pose;
}

}  // namespace esim::inline formats::ros
