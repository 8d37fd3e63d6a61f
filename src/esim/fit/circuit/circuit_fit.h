#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "esim/event_camera/options.h"
#include "esim/fit/circuit/pixel_counts.h"
#include "esim/fit/estimate.h"

namespace esim::inline fit {

/// What circuits are fitted to.
struct CircuitInput {
  EventCameraOptions base;              ///< everything that is not fitted, and where the search begins
  std::vector<PixelCounts> recordings;  ///< of the same pixels
  std::optional<Estimate> on{}, off{};  ///< thresholds, if both were determined from elsewhere
  /// Gets the part of the work that is done, 0 to 1.
  std::function<void(double)> progress{};
};

struct CircuitFit {
  /// Thresholds (unless known), circuit.photocurrent_fa_per_lux, source_follower_hz, photodiode_charge_e and
  /// dark_current_fa.
  std::vector<Estimate> estimates;
  std::vector<Estimate> observations;  ///< latency and bandwidth of small signals at the lights of the lamps
  std::vector<std::string> notes;
};

/// Fits the circuit of a sensor to its events in known light, by repeated simulation (docs/methods/fitting.md, section
/// 5). Determines nothing where `base` has no circuit.
CircuitFit fit_circuit(const CircuitInput& input);

}  // namespace esim::inline fit
