#pragma once

#include <string>
#include <vector>

#include "esim/sampling/options.h"

namespace esim::inline scenario {

/// The sampling method that a line describes: "flow lambda=0.5", or as in a scenario, "{type: flow, lambda: 0.5}".
/// Missing options have their defaults. Throws UserError with the key and the valid values.
SamplingOptions read_sampling(const std::string& text);

/// The inverse of read_sampling(): the type, its first option, and all other options that differ from their defaults.
std::string sampling_text(const SamplingOptions& options);

/// The same without the first option, in which the methods of one family differ: "flow".
std::string sampling_family(const SamplingOptions& options);

/// All types of sampling.
std::vector<std::string> sampling_types();

}  // namespace esim::inline scenario
