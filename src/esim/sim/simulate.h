#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "esim/record/record.h"
#include "esim/sim/world.h"

namespace esim {

/// Wall-clock seconds by stage.
struct StageSeconds {
  double render = 0;    ///< samples for the event cameras
  double sampling = 0;  ///< choosing times, reconstructing between keyframes
  double events = 0;    ///< pixels, and ordering of events
  double frames = 0;    ///< exposing and reading out frame cameras
  double truth = 0;     ///< making of ground truth
  double write = 0;     ///< handing over to sinks; what they do on threads of their own does not count
};

/// What one camera did.
struct CameraSummary {
  std::string name;
  std::string renderer;
  std::int64_t width = 0, height = 0;
  SamplingStatistics sampling;
  std::int64_t events_on = 0, events_off = 0;
  EventCameraStatistics sensor;
  std::int64_t frames = 0;  ///< of the frame camera
};

/// What a simulation did, for the report.
struct Summary {
  bool complete = false;
  std::string problem;        ///< why it ended before its end; empty: it did not, or was interrupted
  TimeNs start = 0, end = 0;  ///< of the time that was simulated
  std::vector<CameraSummary> cameras;
  std::int64_t truth_frames = 0;
  std::int64_t imu_samples = 0;
  StageSeconds seconds;
  double wall_seconds = 0;
};

/// How far a simulation has come.
struct Progress {
  TimeNs start = 0, now = 0, end = 0;
  std::int64_t samples = 0, events = 0;
  double wall_seconds = 0;
};

/// Called after every sample; returns false to end the simulation early.
using Monitor = std::function<bool(const Progress&)>;

/// A simulation that goes on as far as it is told, for bodies whose motion becomes known on the way (motion/online.h).
class Simulator {
 public:
  /// Begins the recording.
  Simulator(World& world, Sink& out);
  ~Simulator();
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// Takes every sample that is due until `t`, or until the end of the body's trajectory where that comes earlier, and
  /// writes what is then certain: of the IMU, everything until then; of all else, everything until the time before
  /// which every camera's events are known. That is behind by less than a sampler's longest interval (min_rate_hz). The
  /// monitor is called after every sample; false where it stopped there, and another call goes on from there.
  bool advance_until(TimeNs t, const Monitor& monitor);

  /// Ends the recording, complete if it has reached the world's end.
  Summary finish();

 private:
  class Run;
  World& world_;
  std::unique_ptr<Run> run_;
};

/// Runs `world` from its start to its end and writes everything to `out`. The spine of the program: time moves only
/// here. What comes before an EngineError is kept: the summary names the problem. Other errors are thrown; `out` has
/// ended then, incomplete, if it had been given anything.
Summary simulate(World& world, Sink& out, const Monitor& monitor);

}  // namespace esim
