#pragma once

#include <vector>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim::inline evaluate {

/// The paper's three schemes over the range of their one option, and every other sampling type with its defaults.
std::vector<SamplingOptions> default_schemes();

/// A few of the paper's schemes, at low cost.
std::vector<SamplingOptions> quick_schemes();

/// Makes an evaluation short, for tests: less time, fewer pixels, a coarser reference of events.
void make_quick(Scenario& scenario, SamplingEvaluationOptions& options);

}  // namespace esim::inline evaluate
