#include "esim/fit/simulated/coupling_match.h"

#include <algorithm>
#include <cmath>

namespace esim::inline fit {
namespace {

constexpr const char* kTooFew = "frames cause too few events";

}  // namespace

CouplingMatch::CouplingMatch(const std::optional<BurstEvents>& real, EventCameraOptions& sensor) {
  constexpr double kUsual = 0.03;  // of a DAVIS240C
  if (!sensor.circuit) {
    unknown_ = "the base has no circuit";
    return;
  }
  given_ = sensor.circuit->frame_coupling;
  if (!real) {
    unknown_ = "no frames were found in the recording by bursts of events";
  } else if (real->events <= kNormalQuantile * real->deviation) {
    unknown_ = kTooFew;
  } else {
    real_ = *real;
    if (given_ <= 0) sensor.circuit->frame_coupling = kUsual;
  }
}

double CouplingMatch::step(EventCameraOptions& sensor, const std::optional<BurstEvents>& simulated, bool near) {
  constexpr double kKept = 0.7, kMostChange = 3, kMost = 1;
  if (!unknown_.empty()) return 1;
  double& coupling = sensor.circuit->frame_coupling;
  const double kept = near ? kKept : 0, before = coupling;
  coupling_ = kept * coupling_ + coupling;
  events_ = kept * events_ + simulated->events;
  deviation_ = kept * deviation_ + simulated->deviation;  // all have the same pixels
  // The events in bursts are about proportional to the coupling.
  const double wanted = real_.events * coupling_ / std::max(1.0, events_);
  coupling = std::clamp(wanted, before / kMostChange, std::min(kMost, before * kMostChange));
  return coupling / before;
}

Estimate CouplingMatch::finish(EventCameraOptions& sensor, const std::string& trouble) const {
  constexpr const char* kName = "circuit.frame_coupling";
  std::string why = unknown_.empty() ? trouble : unknown_;
  const double reach =
      kNormalQuantile * std::hypot(real_.deviation / real_.events, deviation_ / std::max(1.0, events_));
  if (why.empty() && !(reach < 1)) why = kTooFew;
  if (!why.empty()) {
    if (sensor.circuit) sensor.circuit->frame_coupling = given_;
    return Estimate::unknown(kName, "", why);
  }
  const double value = sensor.circuit->frame_coupling;
  return Estimate::found(kName, "", value, value * (1 - reach), value * (1 + reach),
                         "bursts of events at frames, by simulation of the scene");
}

}  // namespace esim::inline fit
