#pragma once

#include <string>
#include <vector>

#include "esim/event_camera/options.h"

namespace esim::app {

/// The sensor that an argument names: a preset, or a YAML file with `event_camera` or with several `cameras`, of which
/// the first counts. The file needs nothing else. `overrides`: options of the event camera, "key=value". Throws
/// UserError.
EventCameraOptions sensor_of(const std::string& argument, const std::vector<std::string>& overrides);

}  // namespace esim::app
