#include "esim/plot/legend.h"

#include <algorithm>
#include <array>

namespace esim::inline plot {
namespace {

constexpr int kBarSide = 12, kLineLength = 24, kTextGap = 7, kEntryGap = 20;

int mark_width(Mark mark) { return mark == Mark::bar ? kBarSide : kLineLength; }

int entry_width(const LegendEntry& entry) {
  return mark_width(entry.mark) + kTextGap + Canvas::text_width(entry.text, kTextHeight);
}

void draw_entry(Canvas& canvas, int x, int baseline, const LegendEntry& entry, const Theme& theme) {
  const int width = mark_width(entry.mark);
  const double middle = baseline - 0.5 * kTextHeight - 0.5;
  if (entry.mark == Mark::bar) {
    canvas.fill({x, baseline - (kTextHeight + kBarSide) / 2, kBarSide, kBarSide}, entry.colour);
  } else {
    const std::array<Spot, 2> ends = {Spot{x + 1.0, middle}, Spot{x + width - 2.0, middle}};
    canvas.polyline(ends, 2, entry.colour);
  }
  if (entry.mark == Mark::line_and_dots) canvas.disc({x + 0.5 * width - 0.5, middle}, 4, entry.colour);
  canvas.text(x + width + kTextGap, baseline, entry.text, kTextHeight, theme.ink);
}

}  // namespace

int legend_width(std::span<const LegendEntry> entries) {
  int width = 0;
  for (const LegendEntry& entry : entries) width += entry_width(entry) + (width > 0 ? kEntryGap : 0);
  return width;
}

int legend_column_width(std::span<const LegendEntry> entries) {
  int width = 0;
  for (const LegendEntry& entry : entries) width = std::max(width, entry_width(entry));
  return width;
}

void draw_legend_row(Canvas& canvas, int x, int baseline, std::span<const LegendEntry> entries, const Theme& theme) {
  for (const LegendEntry& entry : entries) {
    draw_entry(canvas, x, baseline, entry, theme);
    x += entry_width(entry) + kEntryGap;
  }
}

void draw_legend_column(Canvas& canvas, int x, int baseline, std::span<const LegendEntry> entries, const Theme& theme) {
  for (const LegendEntry& entry : entries) {
    draw_entry(canvas, x, baseline, entry, theme);
    baseline += kLegendLine;
  }
}

}  // namespace esim::inline plot
