#pragma once

#include <string>
#include <vector>

#include "esim/evaluate/sampling_evaluation.h"
#include "esim/preview/colours.h"

namespace esim::inline evaluate {

/// Motion over time, with the windows (paper, Figure 8b).
Image<Rgb> draw_motion(const SamplingEvaluation& evaluation);

/// Box plots of the pixels' RMSE for each scheme and window (paper, Figure 5a).
Image<Rgb> draw_error_boxes(const SamplingEvaluation& evaluation);

/// Mean RMSE against frame-equivalents per second, one panel per window (paper, Figure 5b).
Image<Rgb> draw_error_over_cost(const SamplingEvaluation& evaluation);

/// Cumulative distribution of the matched events' timing errors in the last window; an empty image if no events were
/// compared.
Image<Rgb> draw_timing(const SamplingEvaluation& evaluation);

}  // namespace esim::inline evaluate
