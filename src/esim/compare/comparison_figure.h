#pragma once

#include "esim/compare/comparison_text.h"
#include "esim/preview/colours.h"

namespace esim::inline compare {

/// The distributions of two recordings as a figure of 1600 px width: intervals, events of a pixel, and the deviations
/// of all statistics. With the events of the same scene, also their time surfaces at the time `t`.
Image<Rgb> draw_comparison(const RecordingComparison& comparison, EventSpan first, EventSpan second, TimeNs t);

}  // namespace esim::inline compare
