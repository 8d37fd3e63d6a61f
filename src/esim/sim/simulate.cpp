#include "esim/sim/simulate.h"

#include <algorithm>
#include <chrono>

#include "esim/core/engine_error.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/sim/delivery.h"
#include "esim/sim/saved_state.h"
#include "esim/sim/stages.h"

namespace esim::inline sim {
namespace {

/// The camera whose next sample comes first; null if none is due until `until`.
CameraChannel* camera_due(World& world, TimeNs until) {
  CameraChannel* due = nullptr;
  TimeNs earliest = 0;
  for (CameraChannel& camera : world.cameras) {
    const SampleRequest* const next = camera.sampler->next();
    if (next == nullptr || next->last() > until || (due != nullptr && next->t >= earliest)) continue;
    earliest = next->t;
    due = &camera;
  }
  return due;
}

/// The time before which every camera's segments are known.
TimeNs watermark(const World& world) {
  TimeNs earliest = world.info.end;
  for (const CameraChannel& camera : world.cameras) earliest = std::min(earliest, camera.sampler->watermark());
  return earliest;
}

}  // namespace

/// The parts of a simulation, and its results so far.
struct Simulator::Run {
  Run(World& simulated, Sink& sink);
  void advance(CameraChannel& camera);
  Progress progress() const;
  double elapsed() const {
    return earlier_seconds + std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  }

  World& world;
  Sink& out;
  Summary summary;
  Stages stages{world, summary.seconds};           // does the work
  Delivery delivery{world, out, stages, summary};  // writes the records
  TimeNs known_until = 0;                          // the body's motion is known until this time
  double earlier_seconds = 0;                      // until the state from which the simulation continues
  std::chrono::steady_clock::time_point began = std::chrono::steady_clock::now();
};

// --- the program ----------------------------------------------------------------------------------------------------

bool Simulator::advance_until(TimeNs t, const Monitor& monitor) {
  World& world = run_->world;
  run_->known_until = std::min({t, world.trajectory->end(), world.info.end});
  while (CameraChannel* camera = camera_due(world, run_->known_until)) {  // the camera whose next sample comes first
    run_->advance(*camera);  // render the sample, divide it into segments, make events and frames
    run_->delivery.deliver_until(watermark(world));  // write what is now certain, in order of time
    if (!monitor(run_->progress())) return false;
  }
  run_->delivery.deliver_imu_until(run_->known_until);
  return true;
}

/// Takes the next sample of a camera, and passes the segments that it completes to the camera's sensors. The rendering
/// of the sample was started when the previous one had been taken, so that a graphics card works in parallel.
void Simulator::Run::advance(CameraChannel& camera) {
  if (camera.rendering == nullptr) stages.start_rendering(camera, known_until);  // its motion was not yet known
  stages.finish_rendering(camera);
  std::span<const Segment> segments = stages.accept_sample(camera);
  stages.start_rendering(camera, known_until);
  for (; !segments.empty(); segments = stages.more_segments(camera)) {
    stages.look_at_lights(camera, segments);
    stages.make_events(camera, segments);
    stages.expose_frames(camera, segments);
  }
  stages.expose_frames(camera, {});  // exposures that are complete after the last segment
  if (camera.rendering == nullptr) stages.start_rendering(camera, known_until);  // may depend on more_segments()
}

// --- begin and end --------------------------------------------------------------------------------------------------

Simulator::Run::Run(World& simulated, Sink& sink) : world(simulated), out(sink) {
  known_until = std::min(world.info.start, world.trajectory->end());
  summary.start = summary.end = world.info.start;
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    const CameraInfo& info = world.info.cameras[i];
    summary.cameras.push_back(
        {info.name, world.cameras[i].renderer->traits().label(), info.model.width, info.model.height});
    for (const EventSensor& sensor : world.cameras[i].event_sensors)
      summary.cameras[i].sensors.push_back({world.info.cameras[static_cast<std::size_t>(sensor.number)].name});
    stages.start_rendering(world.cameras[i], known_until);
  }
}

Simulator::Simulator(World& world, Sink& out) : run_(std::make_unique<Run>(world, out)) { out.begin(world.info); }

Simulator::~Simulator() = default;

Progress Simulator::Run::progress() const {
  Progress progress{summary.start, summary.end, world.info.end, 0, 0, elapsed()};
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    progress.samples += world.cameras[i].sampler->statistics().samples;
    progress.events += summary.cameras[i].events();
  }
  return progress;
}

std::vector<std::byte> Simulator::state() const {
  run_->summary.wall_seconds = run_->elapsed();
  return save_state(run_->world, run_->summary);
}

void Simulator::restore(std::span<const std::byte> state) {
  for (CameraChannel& camera : run_->world.cameras) camera.rendering.reset();  // of the sampler's first request
  restore_state(state, run_->world, run_->summary);
  run_->earlier_seconds = run_->summary.wall_seconds;
  run_->began = std::chrono::steady_clock::now();
}

Summary Simulator::finish() {
  World& world = run_->world;
  Summary& summary = run_->summary;
  summary.complete = camera_due(world, world.info.end) == nullptr;
  run_->stages.end(run_->out, summary.complete);
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    summary.cameras[i].sampling = world.cameras[i].sampler->statistics();
    for (std::size_t k = 0; k < world.cameras[i].event_sensors.size(); ++k)
      summary.cameras[i].sensors[k].statistics = world.cameras[i].event_sensors[k].event_camera.statistics();
  }
  summary.wall_seconds = run_->elapsed();
  return std::move(summary);
}

Summary simulate(World& world, Sink& out, const Monitor& monitor, Checkpoints* checkpoints) {
  Simulator simulator(world, out);
  bool anything = false;
  std::string problem;
  try {
    if (checkpoints != nullptr && !checkpoints->resumed.empty()) simulator.restore(checkpoints->resumed);
    simulator.advance_until(world.info.end, [&](const Progress& progress) {
      anything |= progress.now > progress.start;
      const bool goes_on = monitor(progress);
      if (checkpoints != nullptr && (!goes_on || checkpoints->due())) checkpoints->save(simulator.state());
      return goes_on;
    });
  } catch (const EngineError& error) {
    problem = error.what();
  } catch (...) {
    if (anything) end_incomplete(out);
    throw;
  }
  Summary summary = simulator.finish();
  summary.problem = problem;
  return summary;
}

}  // namespace esim::inline sim
