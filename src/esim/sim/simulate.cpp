#include "esim/sim/simulate.h"

#include <algorithm>
#include <chrono>

#include "esim/sim/stopwatch.h"

namespace esim {
namespace {

/// The camera whose next sample comes first; null after the last one.
CameraChannel* camera_due(World& world) {
  CameraChannel* due = nullptr;
  TimeNs earliest = 0;
  for (CameraChannel& camera : world.cameras) {
    const auto next = camera.sampler->next();
    if (!next || (due != nullptr && next->t >= earliest)) continue;
    earliest = next->t;
    due = &camera;
  }
  return due;
}

/// The time before which every camera's events are known.
TimeNs watermark(const World& world) {
  TimeNs earliest = world.info.end;
  for (const CameraChannel& camera : world.cameras) earliest = std::min(earliest, camera.sampler->watermark());
  return earliest;
}

/// One run of a world: what it does with each piece of time, and the account of it.
class Run {
 public:
  Run(World& world, Sink& out) : world_(world), out_(out) {
    summary_.start = summary_.end = world.info.start;
    for (std::size_t i = 0; i < world.cameras.size(); ++i) {
      const CameraInfo& info = world.info.cameras[i];
      summary_.cameras.push_back(
          {info.name, world.cameras[i].renderer->traits().label(), info.model.width, info.model.height, {}, 0, 0, {}});
      start_next(world.cameras[i]);
    }
  }

  /// Lets a camera's pixels see its next sample. A graphics card has had the time since its last one to render it.
  void advance(CameraChannel& camera) {
    {
      Stopwatch stopwatch(summary_.seconds.render);
      camera.rendering->finish(camera.sample);
    }
    std::span<const Segment> segments;
    {
      Stopwatch stopwatch(summary_.seconds.sampling);
      segments = camera.sampler->accept(camera.sample);
    }
    start_next(camera);
    while (!segments.empty()) {
      {
        Stopwatch stopwatch(summary_.seconds.events);
        camera.event_camera.integrate(segments, *world_.workers);
      }
      Stopwatch stopwatch(summary_.seconds.sampling);
      segments = camera.sampler->more();
    }
    if (camera.rendering == nullptr) start_next(camera);  // what comes next may have depended on more()
  }

  /// Writes everything up to `until`, all kinds of record together in order of time.
  void deliver(TimeNs until) {
    while (true) {
      const TimeNs t = std::min({until, world_.truth_clock.due(), world_.pose_clock.due()});
      deliver_events(t);
      if (world_.pose_clock.due() == t) deliver_pose(t);
      if (world_.truth_clock.due() == t) deliver_truth(t);
      if (t == until && std::min(world_.truth_clock.due(), world_.pose_clock.due()) > until) break;
    }
    summary_.end = until;
  }

  Progress progress() const {
    Progress progress{summary_.start, summary_.end, world_.info.end, 0, 0, elapsed()};
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      progress.samples += world_.cameras[i].sampler->statistics().samples;
      progress.events += summary_.cameras[i].events_on + summary_.cameras[i].events_off;
    }
    return progress;
  }

  Summary finish(bool complete) {
    {
      Stopwatch stopwatch(summary_.seconds.write);
      out_.end(complete);
    }
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      summary_.cameras[i].sampling = world_.cameras[i].sampler->statistics();
      summary_.cameras[i].sensor = world_.cameras[i].event_camera.statistics();
    }
    summary_.complete = complete;
    summary_.wall_seconds = elapsed();
    return std::move(summary_);
  }

 private:
  std::size_t index_of(const CameraChannel& camera) const {
    return static_cast<std::size_t>(&camera - world_.cameras.data());
  }

  /// Begins to evaluate the scene as the camera's sampler asks for next.
  void start_next(CameraChannel& camera) {
    Stopwatch stopwatch(summary_.seconds.render);
    auto next = camera.sampler->next();
    if (!next) return camera.rendering.reset();
    Renderer& renderer = camera.asked_for(*next);
    camera.rendering = renderer.start(view(world_, index_of(camera), next->t, std::move(next->tiles)));
  }

  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

  void deliver_events(TimeNs until) {
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      events_.clear();
      {
        Stopwatch stopwatch(summary_.seconds.events);
        world_.cameras[i].event_camera.release_until(until, events_);
        const auto on = std::count_if(events_.begin(), events_.end(), [](const Event& e) { return e.polarity > 0; });
        summary_.cameras[i].events_on += on;
        summary_.cameras[i].events_off += static_cast<std::int64_t>(events_.size()) - on;
      }
      if (!events_.empty()) write(EventsRecord{static_cast<int>(i), events_});
    }
  }

  void deliver_pose(TimeNs t) {
    write(PoseRecord{t, world_.trajectory->at(t).T_world_body});
    world_.pose_clock.advance();
  }

  void deliver_truth(TimeNs t) {
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      const RenderRequest request = view(world_, i, t);
      {
        Stopwatch stopwatch(summary_.seconds.truth);
        world_.cameras[i].renderer->render(request, truth_);
      }
      write(TruthRecord{static_cast<int>(i), t, request.camera.T_world_body, truth_.irradiance, truth_.depth,
                        truth_.flow_x, truth_.flow_y});
      ++summary_.truth_frames;
    }
    world_.truth_clock.advance();
  }

  void write(const Record& record) {
    Stopwatch stopwatch(summary_.seconds.write);
    out_.write(record);
  }

  World& world_;
  Sink& out_;
  Summary summary_;
  std::vector<Event> events_;
  Sample truth_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

Summary simulate(World& world, Sink& out, const Monitor& monitor) {
  Run run(world, out);
  out.begin(world.info);
  while (CameraChannel* camera = camera_due(world)) {  // the camera whose next sample comes first
    run.advance(*camera);                              // take it, start the one after it, cross the thresholds
    run.deliver(watermark(world));                     // write what is now certain, in order of time
    if (!monitor(run.progress())) return run.finish(false);
  }
  return run.finish(true);
}

}  // namespace esim
