#pragma once

#include <filesystem>
#include <vector>

#include "esim/scenario/scenario.h"

namespace esim::inline scenario {

/// Reads a YAML file of waypoints: a map whose only key, `points`, is a list as in a scenario. It may be empty.
/// Throws UserError with file, line, key and the valid values.
std::vector<WaypointPointOptions> read_waypoints(const std::filesystem::path& file);

}  // namespace esim::inline scenario
