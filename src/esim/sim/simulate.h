#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

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

  /// The state between two samples as bytes, for restore() of the same build of esim. They do not contain the world.
  std::vector<std::byte> state() const;

  /// Continues from a state of a simulator of an equal world; before advance_until(). The next records are those that
  /// follow the state. Throws UserError if the state does not suit the world.
  void restore(std::span<const std::byte> state);

  /// Ends the recording, complete if it has reached the world's end.
  Summary finish();

 private:
  struct Run;
  std::unique_ptr<Run> run_;
};

/// What makes a simulation resumable.
struct Checkpoints {
  /// Whether it is time to save the state; called after every sample.
  std::function<bool()> due;
  /// Takes the state. All records before it have been written.
  std::function<void(std::vector<std::byte> state)> save;
  /// The state in which the simulation begins, after `out` has received all records before it; empty: the start.
  std::vector<std::byte> resumed{};
};

/// Runs `world` from its start to its end and writes everything to `out`. This is the main loop: time advances only
/// here. After an EngineError, the records before it are kept and the summary contains the problem. Other errors are
/// thrown after `out` has been ended as incomplete if it has received any records. `checkpoints` may be null; a
/// simulation that the monitor stops saves its last state.
Summary simulate(World& world, Sink& out, const Monitor& monitor, Checkpoints* checkpoints = nullptr);

}  // namespace esim::inline sim
