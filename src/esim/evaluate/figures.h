#pragma once

#include <string>
#include <vector>

#include "esim/evaluate/sampling_evaluation.h"
#include "esim/record/preview/colours.h"

namespace esim {

/// Motion over time, with the windows (paper, Figure 8b).
Image<Rgb> draw_motion(const SamplingEvaluation& evaluation);

/// A box of the pixels' RMSE for each scheme and window (paper, Figure 5a).
Image<Rgb> draw_error_boxes(const SamplingEvaluation& evaluation);

/// Mean RMSE over frame-equivalents per second, a panel per window (paper, Figure 5b).
Image<Rgb> draw_error_over_cost(const SamplingEvaluation& evaluation);

/// How many of the matched events are off by how much at most, in the last window; without size where no events were
/// compared.
Image<Rgb> draw_timing(const SamplingEvaluation& evaluation);

}  // namespace esim
