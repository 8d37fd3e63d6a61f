#pragma once

#include <string>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim {

/// The evaluation as a page with its tables, and the figures that lie beside it.
std::string to_markdown(const SamplingEvaluation& evaluation);

}  // namespace esim
