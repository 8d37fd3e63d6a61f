#pragma once

#include "esim/preview/colours.h"
#include "esim/stats/statistics_text.h"

namespace esim::inline stats {

/// The statistics of one file as a figure of 1920 x 1104 px with six panels: rate over time, intervals between events
/// of a pixel, map and histogram of the pixels' rates, phases of the time stamps, and the report.
Image<Rgb> draw_figure(const NamedStatistics& file);

}  // namespace esim::inline stats
