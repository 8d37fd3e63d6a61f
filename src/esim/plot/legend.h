#pragma once

#include <span>
#include <string>

#include "esim/plot/canvas.h"
#include "esim/plot/theme.h"

namespace esim::inline plot {

enum class Mark { bar, line, line_and_dots };

/// What a colour means.
struct LegendEntry {
  std::string text{};
  Rgb colour{};
  Mark mark = Mark::bar;
};

/// The width of the entries in one row, and below each other, px.
int legend_width(std::span<const LegendEntry> entries);
int legend_column_width(std::span<const LegendEntry> entries);

/// Draws the entries in one row that begins at x; text stands on `baseline`.
void draw_legend_row(Canvas& canvas, int x, int baseline, std::span<const LegendEntry> entries, const Theme& theme);

inline constexpr int kLegendLine = 20;  ///< from row to row, px

/// Draws the entries below each other; the text of the first stands on `baseline`.
void draw_legend_column(Canvas& canvas, int x, int baseline, std::span<const LegendEntry> entries, const Theme& theme);

}  // namespace esim::inline plot
