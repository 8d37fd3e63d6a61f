#pragma once

#include <string>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim::inline evaluate {

/// All measurements except the values of single pixels.
std::string to_json(const SamplingEvaluation& evaluation);

/// A table for a terminal, one line per finished scheme: cost and events in the last window, RMSE in each.
std::string text_header(const SamplingEvaluation& evaluation);
std::string text_line(const SchemeResult& scheme);

/// The cost of each family at the goal, one line each.
std::string goal_text(const SamplingEvaluation& evaluation);

}  // namespace esim::inline evaluate
