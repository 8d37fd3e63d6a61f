#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/event_camera/event_camera.h"
#include "esim/sampling/sampler.h"

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

/// Results of one event sensor.
struct SensorSummary {
  std::string name;  ///< of its camera in the recording
  std::int64_t events_on = 0, events_off = 0;
  EventCameraStatistics statistics{};
};

/// Results of one camera.
struct CameraSummary {
  std::string name;
  std::string renderer;
  std::int64_t width = 0, height = 0;
  SamplingStatistics sampling{};
  std::vector<SensorSummary> sensors{};
  std::int64_t frames = 0;  ///< of the frame camera

  /// The number of events of all sensors.
  std::int64_t events() const {
    std::int64_t sum = 0;
    for (const SensorSummary& sensor : sensors) sum += sensor.events_on + sensor.events_off;
    return sum;
  }
};

/// Images of an external engine of which some may come from a cache, so that they took no time to render.
struct EngineImages {
  std::int64_t rendered = 0, from_cache = 0;
  std::string cache;  ///< its folder
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
  std::optional<EngineImages> engine_images{};  ///< if there is a cache
};

}  // namespace esim::inline sim
