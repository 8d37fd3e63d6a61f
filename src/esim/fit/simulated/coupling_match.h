#pragma once

#include <optional>
#include <string>

#include "esim/event_camera/options.h"
#include "esim/fit/estimate.h"
#include "esim/stats/sensor/frame_times.h"

// Private to fit.
namespace esim::inline fit {

/// Finds frame_coupling by the events that frames of the same chip cause (docs/methods/fitting.md, section 4).
class CouplingMatch {
 public:
  /// `real`: events in bursts in the recording; unset if no frames were found. Gives `sensor` a coupling to start with.
  CouplingMatch(const std::optional<BurstEvents>& real, EventCameraOptions& sensor);

  /// Changes the coupling of a sensor of whose events `simulated` are in bursts. Few events are, so that the response
  /// is averaged over the sensors that are `near` the fitted one. Returns by which factor the coupling changes.
  double step(EventCameraOptions& sensor, const std::optional<BurstEvents>& simulated, bool near);

  /// What was found. If it is not determined, for example because of `trouble`, the sensor gets its first coupling
  /// back.
  Estimate finish(EventCameraOptions& sensor, const std::string& trouble) const;

 private:
  std::string unknown_;  // why, if not empty
  double given_ = 0;     // coupling
  BurstEvents real_;
  double coupling_ = 0, events_ = 0, deviation_ = 0;  // weighted sums over simulations
};

}  // namespace esim::inline fit
