#include "esim/preview/panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "esim/files/number_text.h"
#include "esim/plot/canvas.h"
#include "esim/plot/colour_bar.h"
#include "esim/plot/theme.h"
#include "esim/preview/pictures.h"

namespace esim::inline preview {
namespace {

constexpr int kMaxWidth = 1920;
constexpr int kMinPanelWidth = 320;
constexpr int kMaxPanelHeight = 960;
constexpr int kMinColumnWidth = 320;  // for the legends of narrow panels
constexpr int kMargin = 18, kGap = 14;
constexpr int kHeader = 44, kTitle = 30, kLegend = 84;
// Three significant digits, without an exponent.
std::string short_number(float value) {
  const int decimals = value > 0.0f ? std::clamp(2 - static_cast<int>(std::floor(std::log10(value))), 0, 6) : 0;
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (decimals > 0) text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::uint64_t sum(const Image<float>& image) {
  double total = 0;
#pragma omp simd reduction(+ : total)
  for (std::size_t i = 0; i < image.size(); ++i) total += static_cast<double>(image.data()[i]);
  return static_cast<std::uint64_t>(std::llround(total));
}

std::string duration(TimeNs ns) {
  return ns < kNsPerSecond ? fmt::format("{:.3g} ms", 1e3 * to_seconds(ns)) : fmt::format("{:.3g} s", to_seconds(ns));
}

// Colours at the resolution of the camera or, for large cameras, of the panel.
class Panels {
 public:
  Panels(const PreviewLayout& layout, const PreviewFrame& frame) : layout_(layout), frame_(frame) {
    const Image<float>& image = frame.irradiance;
    large_ = image.width() > layout.panel_width || image.height() > layout.panel_height;
    pixels_per_pixel_ = static_cast<float>(image.size()) / static_cast<float>(layout.panel_width * layout.panel_height);
  }

  Image<Rgb> events() const {
    if (!large_) return fit(render_events(frame_.on_events, frame_.off_events, frame_.irradiance));
    return render_events(total(frame_.on_events), total(frame_.off_events), mean(frame_.irradiance));
  }

  Image<Rgb> image() const { return large_ ? grey(mean(frame_.irradiance)) : fit(grey(frame_.irradiance)); }

  Image<Rgb> depth() const {
    const float near_m = frame_.near_m > 0 ? frame_.near_m : 1.0f, far_m = std::max(frame_.far_m, 1.01f * near_m);
    if (!large_) return fit(colour_depth(*frame_.depth_m, near_m, far_m));
    return colour_depth(nearest(*frame_.depth_m), near_m, far_m);
  }

  Image<Rgb> motion_field() const {
    const Image<float>&x = *frame_.motion_x_px_per_s, &y = *frame_.motion_y_px_per_s;
    if (!large_) return fit(colour_motion(x, y, frame_.full_speed_px_per_s));
    return colour_motion(nearest(x), nearest(y), frame_.full_speed_px_per_s);
  }

 private:
  Image<Rgb> fit(const Image<Rgb>& image) const { return enlarge(image, layout_.panel_width, layout_.panel_height); }
  Image<float> mean(const Image<float>& image) const {
    return reduce_mean(image, layout_.panel_width, layout_.panel_height);
  }
  Image<float> nearest(const Image<float>& image) const {
    return reduce_nearest(image, layout_.panel_width, layout_.panel_height);
  }
  Image<float> total(const Image<float>& counts) const {
    Image<float> sums = mean(counts);
    for (float& count : sums.pixels()) count *= pixels_per_pixel_;
    return sums;
  }

  const PreviewLayout& layout_;
  const PreviewFrame& frame_;
  bool large_ = false;
  float pixels_per_pixel_ = 1.0f;
};

void draw_panel_frame(Canvas& canvas, const PreviewLayout& layout, int panel, const char* title) {
  const int x = layout.panel_x(panel), y = layout.panel_y();
  canvas.text(x, y - 10, title, kTitleHeight, kLightTheme.ink);
  canvas.outline({x - 1, y - 1, layout.panel_width + 2, layout.panel_height + 2}, kLightTheme.faint_ink);
}

int draw_swatch(Canvas& canvas, int x, int y, Rgb colour, const std::string& label) {
  constexpr int kSide = 14;
  canvas.fill({x, y, kSide, kSide}, colour);
  canvas.outline({x, y, kSide, kSide}, kLightTheme.faint_ink);
  return kSide + 8 + canvas.text(x + kSide + 8, y + 12, label, kTextHeight, kLightTheme.ink);
}

void draw_events_legend(Canvas& canvas, const PreviewLayout& layout, const PreviewFrame& frame) {
  const int x = layout.panel_x(0), y = layout.legend_y();
  const std::uint64_t on = sum(frame.on_events), off = sum(frame.off_events);
  const int on_width = draw_swatch(canvas, x, y, kOnColour, "ON  " + grouped(on));
  draw_swatch(canvas, x + std::max(on_width + 24, 130), y, kOffColour, "OFF  " + grouped(off));
  const std::string total = frame.since_previous > 0
                                ? fmt::format("{} events in {}", grouped(on + off), duration(frame.since_previous))
                                : fmt::format("{} events", grouped(on + off));
  canvas.text(x, y + 38, total, kTextHeight, kLightTheme.ink);
}

void draw_depth_legend(Canvas& canvas, const PreviewLayout& layout, const PreviewFrame& frame) {
  constexpr int kNothingWidth = 136, kBarHeight = 14;
  const int x = layout.panel_x(1), y = layout.legend_y();
  const int bar = layout.column_width - kNothingWidth;
  draw_swatch(canvas, x + bar + 24, y, kNoDepthColour, "no surface");
  if (frame.near_m <= 0) return;

  const auto colour_of = [&](double depth_m) {
    return colour_depth(static_cast<float>(depth_m), frame.near_m, frame.far_m);
  };
  draw_colour_bar(canvas, {x, y, bar, kBarHeight}, logarithmic_scale(frame.near_m, frame.far_m, "m"),
                  Direction::horizontal, colour_of, kLightTheme);
}

void draw_flow_legend(Canvas& canvas, const PreviewLayout& layout, const PreviewFrame& frame) {
  constexpr int kRadius = 32;
  const int x = layout.panel_x(2), y = layout.legend_y() - 2;
  Image<Rgb> wheel(2 * kRadius + 1, 2 * kRadius + 1, kLightTheme.page);
  for (int v = -kRadius; v <= kRadius; ++v) {
    for (int u = -kRadius; u <= kRadius; ++u) {
      const float radius = std::hypot(static_cast<float>(u), static_cast<float>(v));
      const float coverage = std::clamp(kRadius + 0.5f - radius, 0.0f, 1.0f);
      const float inside = std::min(1.0f, static_cast<float>(kRadius) / std::max(radius, 1.0f));
      const Rgb colour = colour_motion(static_cast<float>(u) * inside, static_cast<float>(v) * inside, kRadius);
      wheel(u + kRadius, v + kRadius) = mix(kLightTheme.page, colour, coverage);
    }
  }
  canvas.draw(wheel, x, y);
  const int text_x = x + 2 * kRadius + 16;
  canvas.text(text_x, y + 26, fmt::format("rim: {} px/s", short_number(frame.full_speed_px_per_s)), kTextHeight,
              kLightTheme.ink);
  canvas.text(text_x, y + 50, "hue: direction of motion", kTextHeight, kLightTheme.faint_ink);
}

/// The parts that do not change from frame to frame.
Image<Rgb> draw_backdrop(const PreviewLayout& layout, const PreviewFrame& frame) {
  Canvas canvas(layout.width, layout.height, kLightTheme.page);
  const int right = layout.panel_x(layout.panels - 1) + layout.column_width;
  canvas.text(right, 30, frame.caption, kTextHeight, kLightTheme.faint_ink, Align::right);
  canvas.fill({kMargin, kHeader - 4, right - kMargin, 1}, kLightTheme.grid);
  draw_panel_frame(canvas, layout, 0, "Events");
  if (frame.depth_m == nullptr) {
    draw_panel_frame(canvas, layout, 1, "Image");
  } else {
    draw_panel_frame(canvas, layout, 1, "Depth");
    draw_panel_frame(canvas, layout, 2, "Motion field");
    draw_depth_legend(canvas, layout, frame);
    draw_flow_legend(canvas, layout, frame);
  }
  return std::move(canvas).take();
}

}  // namespace

PreviewLayout::PreviewLayout(int camera_width, int camera_height, int panel_count) : panels(panel_count) {
  const double max_panel_width = (kMaxWidth - 2 * kMargin - (panels - 1) * kGap) / panels;
  const double whole_factor = (kMinPanelWidth + camera_width - 1) / camera_width;
  const double scale =
      std::min({whole_factor, max_panel_width / camera_width, static_cast<double>(kMaxPanelHeight) / camera_height});
  const auto scaled = [scale](int extent) { return std::max(1, static_cast<int>(scale * extent + 1e-6)); };
  panel_width = scaled(camera_width);
  panel_height = scaled(camera_height);
  column_width = std::max(panel_width, kMinColumnWidth);
  width = 2 * kMargin + (panels - 1) * kGap + panels * column_width;
  height = kHeader + kTitle + panel_height + kLegend + kMargin;
  width += width % 2;
  height += height % 2;
}

int PreviewLayout::panel_x(int panel) const { return kMargin + panel * (column_width + kGap); }
int PreviewLayout::panel_y() const { return kHeader + kTitle; }
int PreviewLayout::legend_y() const { return panel_y() + panel_height + 16; }

Image<Rgb> PreviewPage::compose(const PreviewFrame& frame) {
  const Scales scales{frame.near_m, frame.far_m, frame.full_speed_px_per_s};
  if (backdrop_.empty() || scales != scales_) backdrop_ = draw_backdrop(layout_, frame);
  scales_ = scales;

  Canvas canvas(backdrop_);
  canvas.text(kMargin, 30, fmt::format("t = {:.4f} s", to_seconds(frame.t)), kHeadlineHeight - 1, kLightTheme.ink);
  const auto draw = [&](int panel, const Image<Rgb>& image) {
    canvas.draw(image, layout_.panel_x(panel), layout_.panel_y());
  };
  const Panels panels(layout_, frame);
  draw(0, panels.events());
  draw_events_legend(canvas, layout_, frame);
  if (frame.depth_m == nullptr) {
    draw(1, panels.image());
  } else {
    draw(1, panels.depth());
    draw(2, panels.motion_field());
  }
  return std::move(canvas).take();
}

}  // namespace esim::inline preview
