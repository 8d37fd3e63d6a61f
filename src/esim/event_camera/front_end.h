// Accelerates (1), brightness() in reference.cpp, for a row of pixels.
#pragma once

#include <cstddef>

#include "esim/event_camera/options.h"

namespace esim::inline event_camera {

/// Converts the irradiance of `count` pixels to brightness with the response of the sensor's front end. False if an
/// irradiance is not a finite number >= 0.
bool respond(const EventCameraOptions& options, std::size_t count, const float* irradiance, float* brightness);

}  // namespace esim::inline event_camera
