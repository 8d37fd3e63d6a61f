#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "esim/scenario/scenario.h"

namespace esim::inline scenario {

/// Reads a YAML file of waypoints: a map whose only key, `points`, is a list as in a scenario. It may be empty.
/// Throws UserError with file, line, key and the valid values.
std::vector<WaypointPointOptions> read_waypoints(const std::filesystem::path& file);

/// The text of such a file, one line per point. Reading it back gives the same points.
std::string write_waypoints(std::span<const WaypointPointOptions> points);

}  // namespace esim::inline scenario
