#include "esim/preview/colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "esim/core/colour/srgb.h"
#include "esim/core/fast_arc_tangent.h"
#include "esim/core/fast_log.h"

namespace esim::inline preview {
namespace {

constexpr float kBackgroundLevel = 0.45f;
constexpr float kSaturatingEvents = 8.0f;

std::uint8_t to_byte(float value) { return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 255.0f) + 0.5f); }

const std::array<Rgb, 256>& viridis_map() {
  static const std::array<Rgb, 256> kMap = [] {
    cv::Mat ramp(1, 256, CV_8UC1), coloured;
    for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(ramp, coloured, cv::COLORMAP_VIRIDIS);
    std::array<Rgb, 256> map;
    for (int i = 0; i < 256; ++i) {
      const auto bgr = coloured.at<cv::Vec3b>(0, i);
      map[static_cast<std::size_t>(i)] = {bgr[2], bgr[1], bgr[0]};
    }
    return map;
  }();
  return kMap;
}

// The hues of the flow colour wheel: six arcs, in each of which one component changes linearly, with as many steps as
// are distinguishable.
std::vector<std::array<float, 3>> flow_wheel() {
  struct Arc {
    int steps, component;  // the component that changes
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

/// The colour of a direction and a speed.
class FlowColours {
 public:
  explicit FlowColours(float full_scale) : per_scale_(1.0f / full_scale) {}

  Rgb of(float x, float y) const {
    Rgb colour;
    row(&x, &y, 1, &colour);
    return colour;
  }

  /// Colours `count` pixels, in groups that compile to SIMD code.
  void row(const float* x, const float* y, std::size_t count, Rgb* out) const {
    constexpr std::size_t kTogether = 64;
    std::array<float, kTogether> hue, strength, white;
    const float per_scale = per_scale_;
    for (std::size_t first = 0; first < count; first += kTogether) {
      const std::size_t n = std::min(kTogether, count - first);
#pragma omp simd
      for (std::size_t i = 0; i < n; ++i) {
        const float vx = x[first + i], vy = y[first + i], radius = per_scale * std::sqrt(vx * vx + vy * vy);
        const bool known = radius <= std::numeric_limits<float>::max();
        // Pure colour on the rim, white in the middle, darker outside.
        hue[i] = known ? turn(vx, vy) * (0.5f * kHues) + 0.5f * (kHues + 1) : 0.0f;
        strength[i] = radius <= 1.0f ? radius : (known ? 0.75f : 0.0f);
        white[i] = radius <= 1.0f ? 255.5f - 255.0f * radius : 0.5f;
      }
      for (std::size_t i = 0; i < n; ++i) {
        const std::array<float, 3>& pure = hues_[static_cast<std::size_t>(hue[i])];
        const auto component = [&](std::size_t c) {
          return static_cast<std::uint8_t>(strength[i] * pure[c] + white[i]);
        };
        out[first + i] = {component(0), component(1), component(2)};
      }
    }
  }

 private:
  static constexpr int kHues = 2048;
  using Hues = std::array<std::array<float, 3>, kHues + 1>;

  /// The angle of -(x, y), in half turns: atan2(-y, -x) / pi.
  static float turn(float x, float y) {
    const float size_x = std::fabs(x), size_y = std::fabs(y);
    const float larger = size_x > size_y ? size_x : size_y, smaller = size_x > size_y ? size_y : size_x;
    const float within = fast_arc_tangent(smaller / (larger > 0 ? larger : 1.0f)) * std::numbers::inv_pi_v<float>;
    const float from_axis = size_y > size_x ? 0.5f - within : within;
    const float half_turn = x > 0 ? 1.0f - from_axis : from_axis;
    return y > 0 ? -half_turn : half_turn;
  }

  /// The colours of the wheel from one end to the other.
  static const Hues& hues() {
    static const Hues kTable = [] {
      const std::vector<std::array<float, 3>> wheel = flow_wheel();
      Hues table;
      for (std::size_t i = 0; i <= kHues; ++i) {
        const float position = static_cast<float>(i) / kHues * static_cast<float>(wheel.size() - 1);
        const std::size_t before = std::min(static_cast<std::size_t>(position), wheel.size() - 2);
        const float fraction = position - static_cast<float>(before);
        for (std::size_t c = 0; c < 3; ++c)
          table[i][c] = wheel[before][c] + fraction * (wheel[before + 1][c] - wheel[before][c]);
      }
      return table;
    }();
    return kTable;
  }

  const Hues& hues_ = hues();
  float per_scale_;
};

class DepthColours {
 public:
  DepthColours(float near_m, float far_m)
      : log_near_(fast_log2(near_m)), levels_per_log_(255.0f / (fast_log2(far_m) - log_near_)) {}

  Rgb of(float depth_m) const {
    if (!(depth_m > 0.0f) || depth_m == std::numeric_limits<float>::infinity()) return kNoDepthColour;
    return viridis_map()[to_byte(255.0f - levels_per_log_ * (fast_log2(depth_m) - log_near_))];
  }

 private:
  float log_near_, levels_per_log_;
};

/// Applies `colour` to the sRGB-encoded grey of each irradiance.
template <typename Colour>
Image<Rgb> coloured_levels(const Image<float>& irradiance, const Colour& colour) {
  std::array<Rgb, 256> colours;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const auto level = static_cast<std::uint8_t>(i);
    colours[i] = colour(Rgb{level, level, level});
  }
  const Image<std::uint8_t> levels = encode_srgb(irradiance);
  Image<Rgb> out(levels.width(), levels.height());
  std::transform(levels.pixels().begin(), levels.pixels().end(), out.pixels().begin(),
                 [&](std::uint8_t level) { return colours[level]; });
  return out;
}

}  // namespace

Image<Rgb> dimmed(Image<Rgb> image) {
  for (Rgb& pixel : image.pixels()) pixel = mix({}, pixel, kBackgroundLevel);
  return image;
}

Image<Rgb> render_events(const Image<float>& on, const Image<float>& off, Image<Rgb> background) {
  for (std::size_t i = 0; i < background.size(); ++i) {
    const float count = on.pixels()[i] + off.pixels()[i];
    if (!(count > 0.0f)) continue;
    // One event is clearly visible; each doubling adds the same amount, up to the saturating number.
    const float strength = std::log2(1.0f + count) / std::log2(1.0f + kSaturatingEvents);
    const float opacity = std::min({1.0f, 0.35f + 0.65f * strength, 0.6f * count});
    const Rgb hue = mix(kOffColour, kOnColour, on.pixels()[i] / count);
    background.pixels()[i] = mix(background.pixels()[i], hue, opacity);
  }
  return background;
}

Image<Rgb> render_events(const Image<float>& on, const Image<float>& off, const Image<float>& irradiance) {
  return render_events(on, off, coloured_levels(irradiance, [](Rgb grey) { return mix({}, grey, kBackgroundLevel); }));
}

Image<Rgb> grey(const Image<float>& irradiance) {
  return coloured_levels(irradiance, [](Rgb grey) { return grey; });
}

Rgb colour_motion(float x, float y, float full_scale) { return FlowColours(full_scale).of(x, y); }

Image<Rgb> colour_motion(const Image<float>& motion_x, const Image<float>& motion_y, float full_scale_px_per_s) {
  const FlowColours colours(full_scale_px_per_s);
  Image<Rgb> out(motion_x.width(), motion_x.height());
  colours.row(motion_x.data(), motion_y.data(), out.size(), out.data());
  return out;
}

Rgb viridis(float position) { return viridis_map()[to_byte(255.0f * position)]; }

Rgb colour_depth(float depth_m, float near_m, float far_m) { return DepthColours(near_m, far_m).of(depth_m); }

Image<Rgb> colour_depth(const Image<float>& depth_m, float near_m, float far_m) {
  const DepthColours colours(near_m, far_m);
  Image<Rgb> out(depth_m.width(), depth_m.height());
  std::transform(depth_m.pixels().begin(), depth_m.pixels().end(), out.pixels().begin(),
                 [&](float depth) { return colours.of(depth); });
  return out;
}

}  // namespace esim::inline preview
