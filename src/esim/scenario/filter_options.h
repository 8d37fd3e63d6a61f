#pragma once

#include <string>
#include <vector>

#include "esim/filters/options.h"
#include "esim/scenario/read.h"

namespace esim::inline scenario {

/// No filters with overrides "trail.threshold_us=5000" or "anti_flicker={low_hz: 90}"; a filter of which any option is
/// set, or that is set to {}, is used. Throws UserError, which begins with `setter` if one option is wrong, with the
/// key.
FilterOptions read_filters(const std::vector<std::string>& overrides, const std::string& setter = kSetter);

}  // namespace esim::inline scenario
