#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "esim/recording/record.h"
#include "esim/sim/summary.h"
#include "esim/sim/world.h"

namespace esim::inline sim {

/// Progress of a simulation.
struct Progress {
  TimeNs start = 0, now = 0, end = 0;
  std::int64_t samples = 0, events = 0;
  double wall_seconds = 0;
};

/// Called after every sample; returns false to end the simulation early.
using Monitor = std::function<bool(const Progress&)>;

/// A simulation that advances on request, for bodies whose motion becomes known during it (motion/online.h).
class Simulator {
 public:
  /// Begins the recording.
  Simulator(World& world, Sink& out);
  ~Simulator();
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// Takes every sample that is due until `t`, or until the end of the body's trajectory if that is earlier. Writes the
  /// IMU's measurements until then, and all other records until the time up to which every camera's events are known,
  /// which lags by less than a sampler's longest interval (min_rate_hz). The monitor is called after every sample;
  /// returns false if it stopped the simulation, which another call continues.
  bool advance_until(TimeNs t, const Monitor& monitor);

  /// Ends the recording, complete if it has reached the world's end.
  Summary finish();

 private:
  struct Run;
  std::unique_ptr<Run> run_;
};

/// Runs `world` from its start to its end and writes everything to `out`. This is the main loop: time advances only
/// here. After an EngineError, the records before it are kept and the summary contains the problem. Other errors are
/// thrown after `out` has been ended as incomplete if it has received any records.
Summary simulate(World& world, Sink& out, const Monitor& monitor);

}  // namespace esim::inline sim
