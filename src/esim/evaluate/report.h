#pragma once

#include <string>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim {

/// Everything that was measured, but the values of single pixels.
std::string to_json(const SamplingEvaluation& evaluation);

/// A table for a terminal, whose lines come as the schemes do: cost and events in the last window, RMSE in all.
std::string text_header(const SamplingEvaluation& evaluation);
std::string text_line(const SchemeResult& scheme);

/// What each family costs at the goal, a line each.
std::string goal_text(const SamplingEvaluation& evaluation);

}  // namespace esim
