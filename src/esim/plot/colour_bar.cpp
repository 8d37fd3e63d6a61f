#include "esim/plot/colour_bar.h"

#include <cmath>

namespace esim::inline plot {
namespace {

constexpr int kTickLength = 5, kGap = 5;

std::string unit_of(const Scale& scale, const Ticks& ticks) {
  return scale.title + (ticks.factor.empty() ? "" : " " + ticks.factor);
}

void draw_horizontal(Canvas& canvas, const Tile& bar, const Scale& scale, const Theme& theme) {
  Ticks ticks = ticks_that_fit(scale, bar.width, Direction::horizontal);
  ticks.major.back().label += " " + unit_of(scale, ticks);
  for (const Tick& tick : ticks.major) {
    const int x = bar.x + static_cast<int>(std::lround(scale.position(tick.value) * (bar.width - 1)));
    canvas.fill({x, bar.y + bar.height, 1, kTickLength}, theme.faint_ink);
    canvas.text(x, bar.y + bar.height + kTickLength + kGap + kTextHeight, tick.label, kTextHeight, theme.ink,
                Align::centre);
  }
}

void draw_vertical(Canvas& canvas, const Tile& bar, const Scale& scale, const Theme& theme) {
  const Ticks ticks = ticks_that_fit(scale, bar.height, Direction::vertical);
  for (const Tick& tick : ticks.major) {
    const int y = bar.y + static_cast<int>(std::lround((1 - scale.position(tick.value)) * (bar.height - 1)));
    canvas.fill({bar.x + bar.width, y, kTickLength, 1}, theme.faint_ink);
    canvas.text(bar.x + bar.width + kTickLength + kGap, y + kTextHeight / 2, tick.label, kTextHeight, theme.ink);
  }
  canvas.text(bar.x, bar.y - 2 * kGap, unit_of(scale, ticks), kTextHeight, theme.ink);
}

}  // namespace

void draw_colour_bar(Canvas& canvas, const Tile& bar, const Scale& scale, Direction direction,
                     const std::function<Rgb(double value)>& colour_of, const Theme& theme) {
  const bool is_horizontal = direction == Direction::horizontal;
  const int extent = is_horizontal ? bar.width : bar.height;
  for (int i = 0; i < extent; ++i) {
    const Rgb colour = colour_of(scale.value((i + 0.5) / extent));
    canvas.fill(
        is_horizontal ? Tile{bar.x + i, bar.y, 1, bar.height} : Tile{bar.x, bar.y + bar.height - 1 - i, bar.width, 1},
        colour);
  }
  canvas.outline({bar.x - 1, bar.y - 1, bar.width + 2, bar.height + 2}, theme.faint_ink);
  is_horizontal ? draw_horizontal(canvas, bar, scale, theme) : draw_vertical(canvas, bar, scale, theme);
}

}  // namespace esim::inline plot
