#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "esim/recording/record.h"
#include "esim/sim/world.h"

namespace esim::inline sim {

/// Wall-clock seconds by stage.
struct StageSeconds {
  double render = 0;    ///< samples for the event cameras
  double sampling = 0;  ///< choosing times, reconstructing between keyframes
  double events = 0;    ///< pixels, and ordering of events
  double frames = 0;    ///< exposing and reading out frame cameras
  double truth = 0;     ///< computing ground truth
  double write = 0;     ///< calls of sinks; their background threads do not count
};

/// Results of one camera.
struct CameraSummary {
  std::string name;
  std::string renderer;
  std::int64_t width = 0, height = 0;
  SamplingStatistics sampling;
  std::int64_t events_on = 0, events_off = 0;
  EventCameraStatistics sensor;
  std::int64_t frames = 0;  ///< of the frame camera
};

/// Results of a simulation, for the report.
struct Summary {
  bool complete = false;
  std::string problem;        ///< why it failed before its end; empty if complete or interrupted
  TimeNs start = 0, end = 0;  ///< of the simulated time
  std::vector<CameraSummary> cameras;
  std::int64_t truth_frames = 0;
  std::int64_t imu_samples = 0;
  StageSeconds seconds;
  double wall_seconds = 0;
};

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
  class Run;
  World& world_;
  std::unique_ptr<Run> run_;
};

/// Runs `world` from its start to its end and writes everything to `out`. This is the main loop: time advances only
/// here. After an EngineError, the records before it are kept and the summary contains the problem. Other errors are
/// thrown after `out` has been ended as incomplete if it has received any records.
Summary simulate(World& world, Sink& out, const Monitor& monitor);

}  // namespace esim::inline sim
