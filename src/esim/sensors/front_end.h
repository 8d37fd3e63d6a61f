#pragma once

#include <cstddef>

#include "esim/sensors/event_camera_options.h"

namespace esim {

/// Brightness of `count` pixels from their irradiance, as the sensor's front end responds. False where an irradiance is
/// not a finite number >= 0.
bool respond(const EventCameraOptions& options, std::size_t count, const float* irradiance, float* brightness);

}  // namespace esim
