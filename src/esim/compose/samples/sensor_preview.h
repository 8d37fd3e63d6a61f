#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "esim/compose/compose.h"
#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/scenario/scenario.h"

namespace esim::inline compose {

/// A sensor of a recording with samples, with changed options.
struct SensorPreviewOptions {
  std::filesystem::path recording{};
  std::string camera{};                  ///< the recorded sensor: cam0, or cam0/NAME of several
  std::vector<std::string> overrides{};  ///< as of resense()
  int threads = 0;                       ///< 0: every processor

  /// As in ScenarioText.
  std::function<std::string(const std::filesystem::path& file)> refuses{};
};

/// New events of one sensor for a part of a recording, as resense() makes them for all of it. The pixels begin a short
/// time before the requested one (kWarmUp, or kCircuitWarmUp if they are circuits), so that their first events differ
/// from those of the complete recording. Not thread-safe.
class SensorPreview {
 public:
  static constexpr TimeNs kWarmUp = 250 * kNsPerMs, kCircuitWarmUp = 10 * kNsPerMs;

  /// Throws UserError for options and recordings that resense() refuses.
  explicit SensorPreview(SensorPreviewOptions options);
  ~SensorPreview();

  /// The scenario with this sensor only, and without a scene.
  const Scenario& scenario() const;

  /// Why the events are not those of a simulation with this sensor, apart from the first events; empty if they are.
  const std::string& inexact() const;

  /// The events with from <= t <= to (ns), in order. Continues where the last request ended if that is possible.
  /// Returns an empty list if `goes_on`, which is called often, returns false. Throws UserError if the store is
  /// damaged.
  std::vector<Event> events(TimeNs from, TimeNs to, const std::function<bool()>& goes_on);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace esim::inline compose
