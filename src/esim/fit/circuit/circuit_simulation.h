#pragma once

#include <cstdint>

#include "esim/event_camera/options.h"
#include "esim/fit/circuit/pixel_counts.h"

namespace esim::inline fit {

/// A sensor as circuits are fitted: irradiance is the illuminance of the sensor in lux, the readout is ideal, and no
/// pixel is hot or dead. It must have a circuit.
EventCameraOptions on_bench(EventCameraOptions sensor);

/// Points of the light in a period, between which its logarithm is linear: numbers of events change by 0.02 % if there
/// are more.
inline constexpr int kPointsOfPeriod = 128;

/// Simulates such a sensor of `side` x `side` pixels in light that has been on for `settling` (in the unit of
/// `extent`), and counts its events during `extent`.
PixelCounts simulate_counts(const EventCameraOptions& sensor, const KnownLight& light, double settling, double extent,
                            int side, std::uint64_t seed, int points = kPointsOfPeriod);

}  // namespace esim::inline fit
