#pragma once

#include <cstdint>

#include "esim/event_camera/options.h"
#include "esim/fit/circuit/pixel_counts.h"

namespace esim::inline fit {

/// A sensor as circuits are fitted: irradiance is the illuminance of the sensor in lux, the readout is ideal, and no
/// pixel is hot or dead. It must have a circuit.
EventCameraOptions on_bench(EventCameraOptions sensor);

/// Points of the light in a period, between which its logarithm is linear: 512 change numbers of events by less than
/// 0.1 %.
inline constexpr int kPointsOfPeriod = 64;

/// Simulates such a sensor of `side` x `side` pixels in light that has been on for `settling`, and counts its events
/// during `extent`: complete periods of a lamp, or seconds of constant light. Half of the `points` of a period suffice
/// while the pixels settle.
PixelCounts simulate_counts(const EventCameraOptions& sensor, const KnownLight& light, double settling, double extent,
                            int side, std::uint64_t seed, int points = kPointsOfPeriod);

}  // namespace esim::inline fit
