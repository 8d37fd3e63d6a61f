#pragma once

#include <vector>

#include "esim/evaluate/sampling_evaluation.h"

namespace esim {

/// The paper's three schemes over the range of their one option, and every other way of sampling that there is with its
/// defaults.
std::vector<SamplingOptions> default_schemes();

/// Two of each of the paper's, at low cost.
std::vector<SamplingOptions> quick_schemes();

/// Makes an evaluation short: less time, fewer pixels, a coarser reference of events. Suits a test.
void make_quick(Scenario& scenario, SamplingEvaluationOptions& options);

}  // namespace esim
