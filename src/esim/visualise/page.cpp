#include "esim/visualise/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esim/plot/canvas.h"
#include "esim/preview/colours.h"
#include "esim/preview/pictures.h"

namespace esim::inline visualise {
namespace {

constexpr int kMargin = 20, kGap = 18, kHeader = 42, kTitle = 28, kLegend = 30;
constexpr int kMaxPanelHeight = 960, kMinPanelExtent = 64;

int draw_polarity(Canvas& canvas, int x, int baseline, Rgb colour, const char* name, const Theme& theme) {
  canvas.disc({x + 5.0, baseline - 5.0}, 5, colour);
  return 16 + canvas.text(x + 16, baseline, name, kTextHeight, theme.faint_ink) + 18;
}

// A colour bar between two labels.
void draw_depth_legend(Canvas& canvas, int x, int baseline, const Panel& panel, const Theme& theme) {
  constexpr int kBar = 140;
  x += canvas.text(x, baseline, fmt::format("{:.3g} m", panel.near_m), kTextHeight, theme.faint_ink) + 10;
  for (int i = 0; i < kBar; ++i) {
    const float depth = panel.near_m * std::pow(panel.far_m / panel.near_m, (static_cast<float>(i) + 0.5f) / kBar);
    canvas.fill({x + i, baseline - 10, 1, 10}, colour_depth(depth, panel.near_m, panel.far_m));
  }
  canvas.text(x + kBar + 10, baseline, fmt::format("{:.3g} m", panel.far_m), kTextHeight, theme.faint_ink);
}

void draw_motion_legend(Canvas& canvas, int x, int baseline, const Panel& panel, const Theme& theme) {
  constexpr int kRadius = 11, kExtent = 2 * kRadius + 3;
  Image<Rgb> wheel(kExtent, kExtent, theme.page);
  for (int row = 0; row < kExtent; ++row) {
    for (int column = 0; column < kExtent; ++column) {
      const auto u = static_cast<float>(column - kRadius - 1), v = static_cast<float>(row - kRadius - 1);
      const float radius = std::max(std::hypot(u, v), 1e-3f), inside = std::min(1.0f, kRadius / radius);
      wheel(column, row) = mix(theme.page, colour_motion(u * inside, v * inside, kRadius),
                               std::clamp(kRadius + 0.5f - radius, 0.0f, 1.0f));
    }
  }
  canvas.draw(wheel, x, baseline - kRadius - 6);
  canvas.text(x + kExtent + 8, baseline, fmt::format("rim: {:.3g} px/s", panel.full_speed_px_per_s), kTextHeight,
              theme.faint_ink);
}

void draw_panel(Canvas& canvas, const Tile& place, View view, const Panel& panel, const Theme& theme) {
  const int used = canvas.text(place.x, place.y - 10, title_of(view), kTitleHeight, theme.ink);
  if (used + Canvas::text_width(panel.note, kTextHeight) + kGap < place.width)
    canvas.text(place.x + place.width, place.y - 10, panel.note, kTextHeight, theme.faint_ink, Align::right);
  if (panel.picture.empty()) {
    canvas.fill(place, theme.ground);
  } else {
    canvas.draw(enlarge(panel.picture, place.width, place.height), place.x, place.y);
  }
  canvas.outline({place.x - 1, place.y - 1, place.width + 2, place.height + 2}, theme.grid);
  const int baseline = place.y + place.height + 20;
  if (panel.polarities) {
    const int width = draw_polarity(canvas, place.x, baseline, kOnColour, "ON", theme);
    draw_polarity(canvas, place.x + width, baseline, kOffColour, "OFF", theme);
  }
  if (panel.near_m > 0) draw_depth_legend(canvas, place.x, baseline, panel, theme);
  if (panel.full_speed_px_per_s > 0) draw_motion_legend(canvas, place.x, baseline, panel, theme);
}

}  // namespace

std::string_view name_of(View view) {
  constexpr std::array<std::string_view, kViews> kNames = {"events", "time-surface", "space-time",
                                                           "image",  "depth",        "motion"};
  return kNames[static_cast<std::size_t>(view)];
}

std::string_view title_of(View view) {
  constexpr std::array<std::string_view, kViews> kTitles = {"Events", "Time surface", "Space and time",
                                                            "Image",  "Depth",        "Motion field"};
  return kTitles[static_cast<std::size_t>(view)];
}

PageLayout::PageLayout(const std::vector<View>& shown, SensorSize sensor, int wanted_width) : views(shown) {
  const int count = static_cast<int>(views.size());
  columns = count <= 3 ? count : (count + 1) / 2;
  rows = (count + columns - 1) / columns;
  const bool space_time_alone = count == 1 && views.front() == View::space_time;
  const double aspect =
      space_time_alone ? 1.6 : std::clamp(static_cast<double>(sensor.width) / sensor.height, 0.2, 5.0);
  constexpr std::array<int, 3> kWidths = {960, 1440, 1920};
  const int full = wanted_width > 0 ? wanted_width : kWidths[static_cast<std::size_t>(columns - 1)];
  const double across = static_cast<double>(full - 2 * kMargin - (columns - 1) * kGap) / columns;
  panel_width = std::max(kMinPanelExtent, static_cast<int>(std::min(across, kMaxPanelHeight * aspect / rows)));
  panel_height = std::max(kMinPanelExtent, static_cast<int>(std::lround(panel_width / aspect)));
  width = 2 * kMargin + columns * panel_width + (columns - 1) * kGap;
  height = kHeader + rows * (kTitle + panel_height + kLegend) + kMargin / 2;
  width += width % 2;
  height += height % 2;
}

Tile PageLayout::panel(std::size_t index) const {
  const int column = static_cast<int>(index) % columns, row = static_cast<int>(index) / columns;
  return {kMargin + column * (panel_width + kGap), kHeader + row * (kTitle + panel_height + kLegend) + kTitle,
          panel_width, panel_height};
}

Image<Rgb> draw_page(const PageLayout& layout, const std::vector<Panel>& panels, const std::string& left,
                     const std::string& right, const Theme& theme) {
  Canvas canvas(layout.width, layout.height, theme.page);
  const int used = canvas.text(kMargin, 28, left, kHeadlineHeight - 1, theme.ink);
  if (used + Canvas::text_width(right, kTextHeight) + 3 * kMargin < layout.width) {
    canvas.text(layout.width - kMargin, 28, right, kTextHeight, theme.faint_ink, Align::right);
  }
  canvas.fill({kMargin, kHeader - 2, layout.width - 2 * kMargin, 1}, theme.grid);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    draw_panel(canvas, layout.panel(i), layout.views[i], panels[i], theme);
  }
  return std::move(canvas).take();
}

Image<Rgb> draw_contact_sheet(const std::vector<CaptionedPicture>& pictures, int columns, const Theme& theme) {
  if (pictures.empty()) return {};
  const int width = pictures.front().picture.width(), height = pictures.front().picture.height();
  const int rows = (static_cast<int>(pictures.size()) + columns - 1) / columns;
  Canvas canvas(2 * kMargin + columns * width + (columns - 1) * kGap, rows * (kTitle + height) + kMargin, theme.page);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const int x = kMargin + static_cast<int>(i) % columns * (width + kGap);
    const int y = kTitle + static_cast<int>(i) / columns * (kTitle + height);
    canvas.text(x, y - 9, pictures[i].caption, kTextHeight, theme.faint_ink);
    canvas.draw(pictures[i].picture, x, y);
    canvas.outline({x - 1, y - 1, width + 2, height + 2}, theme.grid);
  }
  return std::move(canvas).take();
}

}  // namespace esim::inline visualise
