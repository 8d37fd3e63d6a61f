#pragma once

#include <functional>

#include "esim/plot/canvas.h"
#include "esim/plot/scale.h"
#include "esim/plot/theme.h"
#include "esim/plot/tick_layout.h"

namespace esim::inline plot {

/// Draws the colours of a scale into `bar`, from left to right with ticks below, or from bottom to top with ticks to
/// the right. The scale's title is the unit: it follows the last label of a horizontal bar, and is above a vertical
/// one.
void draw_colour_bar(Canvas& canvas, const Tile& bar, const Scale& scale, Direction direction,
                     const std::function<Rgb(double value)>& colour_of, const Theme& theme);

}  // namespace esim::inline plot
