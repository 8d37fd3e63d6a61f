#pragma once

#include <string>
#include <vector>

#include "esim/sampling/options.h"

namespace esim {

/// The way of sampling that a line describes: "flow lambda=0.5", or as in a scenario, "{type: flow, lambda: 0.5}".
/// Options that it does not name have their defaults. Throws UserError with the key and what would be right.
SamplingOptions read_sampling(const std::string& text);

/// The line that read_sampling() makes the same options of: the type, its first option, and what else differs from the
/// defaults.
std::string sampling_text(const SamplingOptions& options);

/// The same without the first option, by which schemes of one family differ: "flow".
std::string sampling_family(const SamplingOptions& options);

/// The types that there are.
std::vector<std::string> sampling_types();

}  // namespace esim
