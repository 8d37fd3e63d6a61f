#include "esim/record/preview/colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "esim/record/formats/images_png.h"

namespace esim {
namespace {

constexpr float kBackgroundLevel = 0.45f;
constexpr float kSaturatingEvents = 8.0f;

std::uint8_t to_byte(float value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0f, 255.0f))); }

std::array<Rgb, 256> viridis() {
  cv::Mat ramp(1, 256, CV_8UC1), coloured;
  for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(ramp, coloured, cv::COLORMAP_VIRIDIS);
  std::array<Rgb, 256> map;
  for (int i = 0; i < 256; ++i) {
    const auto bgr = coloured.at<cv::Vec3b>(0, i);
    map[static_cast<std::size_t>(i)] = {bgr[2], bgr[1], bgr[0]};
  }
  return map;
}

// The hues of the flow wheel: six arcs of a linear change in one component, as long as the eye tells steps apart.
std::vector<std::array<float, 3>> flow_wheel() {
  struct Arc {
    int steps, component;  // which changes
    bool rises;
    std::array<float, 3> start;
  };
  constexpr std::array<Arc, 6> kArcs = {{{15, 1, true, {255, 0, 0}},      // red to yellow
                                         {6, 0, false, {255, 255, 0}},    // yellow to green
                                         {4, 2, true, {0, 255, 0}},       // green to cyan
                                         {11, 1, false, {0, 255, 255}},   // cyan to blue
                                         {13, 0, true, {0, 0, 255}},      // blue to magenta
                                         {6, 2, false, {255, 0, 255}}}};  // magenta to red
  std::vector<std::array<float, 3>> wheel;
  for (const Arc& arc : kArcs) {
    for (int i = 0; i < arc.steps; ++i) {
      auto colour = arc.start;
      const float step = std::floor(255.0f * static_cast<float>(i) / static_cast<float>(arc.steps));
      colour[static_cast<std::size_t>(arc.component)] = arc.rises ? step : 255.0f - step;
      wheel.push_back(colour);
    }
  }
  return wheel;
}

}  // namespace

Rgb mix(Rgb from, Rgb to, float amount) {
  const auto blend = [amount](std::uint8_t a, std::uint8_t b) {
    return to_byte(static_cast<float>(a) + amount * static_cast<float>(b - a));
  };
  return {blend(from.r, to.r), blend(from.g, to.g), blend(from.b, to.b)};
}

Image<Rgb> dimmed(Image<Rgb> image) {
  for (Rgb& pixel : image.pixels()) pixel = mix({}, pixel, kBackgroundLevel);
  return image;
}

Image<Rgb> render_events(const Image<float>& on, const Image<float>& off, Image<Rgb> background) {
  for (std::size_t i = 0; i < background.size(); ++i) {
    const float count = on.pixels()[i] + off.pixels()[i];
    if (!(count > 0.0f)) continue;
    // One event is seen well; each doubling adds the same, up to the saturating number.
    const float strength = std::log2(1.0f + count) / std::log2(1.0f + kSaturatingEvents);
    const float opacity = std::min({1.0f, 0.35f + 0.65f * strength, 0.6f * count});
    const Rgb hue = mix(kOffColour, kOnColour, on.pixels()[i] / count);
    background.pixels()[i] = mix(background.pixels()[i], hue, opacity);
  }
  return background;
}

Image<Rgb> render_events(const Image<float>& on, const Image<float>& off, const Image<float>& irradiance) {
  return render_events(on, off, dimmed(grey(irradiance)));
}

Image<Rgb> grey(const Image<float>& irradiance) {
  const Image<std::uint8_t> levels = encode_srgb(irradiance);
  Image<Rgb> out(levels.width(), levels.height());
  std::transform(levels.pixels().begin(), levels.pixels().end(), out.pixels().begin(), [](std::uint8_t level) {
    return Rgb{level, level, level};
  });
  return out;
}

Rgb colour_flow(float x, float y, float full_scale) {
  static const std::vector<std::array<float, 3>> kWheel = flow_wheel();
  const float radius = std::hypot(x, y) / full_scale;
  if (!std::isfinite(radius)) return {};
  const auto steps = static_cast<float>(kWheel.size());
  const float turn = std::atan2(-y, -x) / std::numbers::pi_v<float>;  // -1 to 1
  const float position = (turn + 1.0f) / 2.0f * (steps - 1.0f);
  const std::size_t before = std::min(static_cast<std::size_t>(position), kWheel.size() - 1);
  const std::size_t after = (before + 1) % kWheel.size();
  const float fraction = position - static_cast<float>(before);
  const auto component = [&](std::size_t i) {
    const float hue = ((1.0f - fraction) * kWheel[before][i] + fraction * kWheel[after][i]) / 255.0f;
    return to_byte(255.0f * (radius <= 1.0f ? 1.0f - radius * (1.0f - hue) : 0.75f * hue));
  };
  return {component(0), component(1), component(2)};
}

Image<Rgb> colour_flow(const Image<float>& flow_x, const Image<float>& flow_y, float full_scale_px_per_s) {
  Image<Rgb> out(flow_x.width(), flow_x.height());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out.pixels()[i] = colour_flow(flow_x.pixels()[i], flow_y.pixels()[i], full_scale_px_per_s);
  }
  return out;
}

Rgb colour_depth(float depth_m, float near_m, float far_m) {
  static const std::array<Rgb, 256> kMap = viridis();
  if (!(depth_m > 0.0f) || depth_m == std::numeric_limits<float>::infinity()) return kNoDepthColour;
  const float position = std::clamp(std::log(depth_m / near_m) / std::log(far_m / near_m), 0.0f, 1.0f);
  return kMap[static_cast<std::size_t>(std::lround(255.0f * (1.0f - position)))];
}

Image<Rgb> colour_depth(const Image<float>& depth_m, float near_m, float far_m) {
  Image<Rgb> out(depth_m.width(), depth_m.height());
  std::transform(depth_m.pixels().begin(), depth_m.pixels().end(), out.pixels().begin(),
                 [&](float depth) { return colour_depth(depth, near_m, far_m); });
  return out;
}

}  // namespace esim
