#pragma once

#include <string>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim::inline evaluate {

/// The evaluation as a Markdown page with its tables and links to its figures.
std::string to_markdown(const SamplingEvaluation& evaluation);

}  // namespace esim::inline evaluate
