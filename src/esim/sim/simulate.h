#pragma once

#include <cstdint>
#include <functional>
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
};

/// What a simulation did, for the report.
struct Summary {
  bool complete = false;
  TimeNs start = 0, end = 0;  ///< of the time that was simulated
  std::vector<CameraSummary> cameras;
  std::int64_t truth_frames = 0;
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

/// Runs `world` from its start to its end and writes everything to `out`. The spine of the program: time moves only
/// here.
Summary simulate(World& world, Sink& out, const Monitor& monitor);

}  // namespace esim
