#pragma once

#include <optional>

#include "esim/event_camera/options.h"

namespace esim::inline event_camera {

/// Standard deviation of a circuit's noise at an irradiance (1: white), as brightness, where the comparators see it.
double noise_deviation(const CircuitOptions& circuit, double irradiance);

/// The expected rate of a pixel's noise events, ON and OFF, in constant light, Hz, without leak. An estimate
/// (docs/methods/circuit.md) within a factor of 1.7 for thresholds of 0.3 to 3.5 standard deviations.
double noise_rate_hz(const EventCameraOptions& options, double irradiance);

/// How much noise a camera has in the light where it has most.
struct NoiseEstimate {
  double threshold = 0;  ///< the smaller one
  double deviation = 0;  ///< in the dark, where it is largest
  double irradiance = 0;
  double rate_hz = 0;  ///< events of a pixel at this irradiance
};

/// Set if the noise of a circuit reaches its thresholds all the time: if a threshold is below twice the standard
/// deviation in the dark.
std::optional<NoiseEstimate> excessive_noise(const EventCameraOptions& options);

/// The maximum rate of events of a pixel by CircuitOptions::max_rate_hz, Hz; infinity: no maximum.
double max_rate_hz(const EventCameraOptions& options);

}  // namespace esim::inline event_camera
