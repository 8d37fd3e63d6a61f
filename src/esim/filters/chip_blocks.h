#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "esim/filters/options.h"

namespace esim::inline filters {

/// One line for each filter of `options` that the sensor does not have: "trail: the davis346 has no such filter, but
/// ...", with the sensors that have it. `sensor` is the name of a preset; a version after "@" makes no difference.
/// Names that do not stand for a real sensor, such as ideal, give no lines.
std::vector<std::string> missing_blocks(const FilterOptions& options, std::string_view sensor);

}  // namespace esim::inline filters
