#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/event_camera/options.h"
#include "esim/fit/estimate.h"
#include "esim/stats/sensor/frame_times.h"
#include "esim/stats/sensor/sensor_statistics.h"

namespace esim::inline fit {

/// What a sensor is fitted by.
struct ClipStatistics {
  SensorStatistics sensor;
  /// The events in bursts at the times of the recording's frames; unset if no frames were found in it.
  std::optional<BurstEvents> bursts;
};

/// Simulates a sensor that sees the scene of a recording. Its chip takes frames, if any, when that of the recording
/// does.
using SimulatedClip = std::function<ClipStatistics(const EventCameraOptions&)>;

/// A sensor fitted to a recording of a moving scene.
struct SimulationFit {
  EventCameraOptions options;       ///< the base, with what the recording determines
  std::vector<Estimate> estimates;  ///< one for each parameter that is considered, determined or not
  int simulations = 0;
};

/// Tables of the parameters, and what is not determined.
std::string describe(const SimulationFit& fit);

/// Fits thresholds, refractory period, readout, leak and frame coupling of a sensor to the statistics of a recording,
/// by repeated simulation of the same scene (docs/methods/fitting.md, section 4). Parameters that the recording does
/// not determine stay as in `base`.
SimulationFit fit_by_simulation(const EventCameraOptions& base, const ClipStatistics& real,
                                const SimulatedClip& simulate);

}  // namespace esim::inline fit
