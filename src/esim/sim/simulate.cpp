#include "esim/sim/simulate.h"

#include <algorithm>
#include <chrono>

#include "esim/core/engine_error.h"
#include "esim/motion/imu_kinematics.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/sim/stopwatch.h"

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

/// The time before which every camera's events are known.
TimeNs watermark(const World& world) {
  TimeNs earliest = world.info.end;
  for (const CameraChannel& camera : world.cameras) earliest = std::min(earliest, camera.sampler->watermark());
  return earliest;
}

}  // namespace

/// One run of a world: processes each piece of time and collects the summary.
class Simulator::Run {
 public:
  Run(World& world, Sink& out)
      : world_(world), out_(out), known_until_(std::min(world.info.start, world.trajectory->end())) {
    summary_.start = summary_.end = world.info.start;
    for (std::size_t i = 0; i < world.cameras.size(); ++i) {
      const CameraInfo& info = world.info.cameras[i];
      summary_.cameras.push_back(
          {info.name, world.cameras[i].renderer->traits().label(), info.model.width, info.model.height, {}, 0, 0, {}});
      start_next(world.cameras[i]);
    }
  }

  /// The body's motion is known until `until`, so that samples until then may be started.
  void know(TimeNs until) { known_until_ = until; }

  /// Processes the next sample of a camera. A graphics card has rendered it since the previous sample.
  void advance(CameraChannel& camera) {
    if (camera.rendering == nullptr) start_next(camera);  // its motion was not yet known
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
      if (camera.event_camera) {
        Stopwatch stopwatch(summary_.seconds.events);
        camera.event_camera->integrate(segments, camera.sampler->watermark(), *world_.workers);
      }
      expose(camera, segments);
      Stopwatch stopwatch(summary_.seconds.sampling);
      segments = camera.sampler->more();
    }
    expose(camera, {});                                   // exposures that are complete after the last segment
    if (camera.rendering == nullptr) start_next(camera);  // the next request may depend on more()
  }

  /// Writes all records up to `until`, all kinds together in order of time.
  void deliver(TimeNs until) {
    while (true) {
      const TimeNs t = std::min(until, due());
      deliver_events(t);
      if (imu_due() == t) deliver_imu(t);
      if (world_.pose_clock.due() == t) deliver_pose(t);
      if (world_.truth_clock.due() == t) deliver_truth(t);
      deliver_frames(t);
      if (t == until && due() > until) break;
    }
    summary_.end = until;
  }

  /// Writes the IMU's measurements up to `until`, before records that must wait for cameras.
  void deliver_imu_until(TimeNs until) {
    while (imu_due() <= until) deliver_imu(imu_due());
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
      if (world_.cameras[i].event_camera) summary_.cameras[i].sensor = world_.cameras[i].event_camera->statistics();
    }
    summary_.complete = complete;
    summary_.wall_seconds = elapsed();
    return std::move(summary_);
  }

 private:
  std::size_t index_of(const CameraChannel& camera) const {
    return static_cast<std::size_t>(&camera - world_.cameras.data());
  }

  /// Starts the next rendering that the camera's sampler requests.
  void start_next(CameraChannel& camera) {
    Stopwatch stopwatch(summary_.seconds.render);
    const SampleRequest* const next = camera.sampler->next();
    if (next == nullptr || next->last() > known_until_) return camera.rendering.reset();
    std::vector<RenderRequest> views = {view(world_, index_of(camera), next->t, next->tiles)};
    for (const auto& [t, tiles] : next->later) views.push_back(view(world_, index_of(camera), t, tiles));
    for (RenderRequest& view : views) view.motion_rows = next->motion_rows;
    Renderer& renderer = next->renderer != nullptr ? *next->renderer : *camera.renderer;
    camera.rendering = renderer.start_together(std::move(views));
  }

  /// Gives the frame camera the segments of the event camera.
  void expose(CameraChannel& camera, std::span<const Segment> segments) {
    if (!camera.frame_camera) return;
    Stopwatch stopwatch(summary_.seconds.frames);
    camera.frame_camera->integrate(segments, camera.sampler->watermark(), *world_.workers);
  }

  TimeNs imu_due() const { return world_.imu ? world_.imu->clock.due() : PeriodicClock::kNever; }

  /// The time of the next due record except events. A frame is due when its exposure ends.
  TimeNs due() const {
    TimeNs due = std::min({world_.truth_clock.due(), world_.pose_clock.due(), imu_due()});
    for (const CameraChannel& camera : world_.cameras) {
      if (camera.frame_camera) due = std::min(due, camera.frame_camera->due());
    }
    return due;
  }

  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

  void deliver_events(TimeNs until) {
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      if (!world_.cameras[i].event_camera) continue;
      events_.clear();
      {
        Stopwatch stopwatch(summary_.seconds.events);
        world_.cameras[i].event_camera->release_until(until, events_);
        const auto on = std::count_if(events_.begin(), events_.end(), [](const Event& e) { return e.polarity > 0; });
        summary_.cameras[i].events_on += on;
        summary_.cameras[i].events_off += static_cast<std::int64_t>(events_.size()) - on;
      }
      if (events_.empty()) continue;
      write(EventsRecord{static_cast<int>(i), events_});
      if (world_.cameras[i].event_points) deliver_event_points(i);
    }
  }

  void deliver_event_points(std::size_t camera) {
    {
      Stopwatch stopwatch(summary_.seconds.truth);
      world_.cameras[camera].event_points->locate(events_, event_points_);
    }
    write(EventPointsRecord{static_cast<int>(camera), events_, event_points_});
  }

  void deliver_pose(TimeNs t) {
    PoseRecord pose{t, world_.trajectory->at(t)};
    for (const auto& object : world_.objects) pose.objects.push_back(object->at(t));
    if (world_.imu) pose.imu_bias = world_.imu->sensor.bias(t);
    write(pose);
    world_.pose_clock.advance();
  }

  void deliver_imu(TimeNs t) {
    ImuChannel& imu = *world_.imu;
    const InertialSignals truth =
        inertial_signals(world_.trajectory->at(t), imu.T_body_imu, imu.sensor.options().gravity);
    write(ImuRecord{t, imu.sensor.measure(t, truth), imu.sensor.bias(t)});
    ++summary_.imu_samples;
    imu.clock.advance();
  }

  void deliver_truth(TimeNs t) {
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      RenderRequest request = view(world_, i, t);
      request.which_objects = world_.truth_objects;
      object_poses_.clear();
      for (const Kinematics& object : request.objects) object_poses_.push_back(object.T_world_body);
      const Displacement* displacement = nullptr;
      {
        Stopwatch stopwatch(summary_.seconds.truth);
        world_.cameras[i].renderer->render(request, truth_);
        if (world_.cameras[i].displacement) displacement = world_.cameras[i].displacement->advance(request, truth_);
      }
      write(TruthRecord{static_cast<int>(i), t, request.camera.T_world_body, truth_.irradiance, truth_.depth,
                        truth_.flow_x, truth_.flow_y, world_.truth_objects ? &truth_.object : nullptr, object_poses_});
      if (displacement != nullptr) {
        write(DisplacementRecord{static_cast<int>(i), displacement->t0, displacement->t1, displacement->x,
                                 displacement->y, displacement->visible});
      }
      ++summary_.truth_frames;
    }
    world_.truth_clock.advance();
  }

  void deliver_frames(TimeNs t) {
    for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
      std::optional<FrameCamera>& camera = world_.cameras[i].frame_camera;
      if (!camera || camera->due() != t) continue;
      const CameraFrame frame = camera->take();
      write(FrameRecord{static_cast<int>(i), frame.t, frame.exposure_start, frame.exposure, camera->options().gain,
                        frame.numbers, camera->options().bits});
      ++summary_.cameras[i].frames;
    }
  }

  void write(const Record& record) {
    Stopwatch stopwatch(summary_.seconds.write);
    out_.write(record);
  }

  World& world_;
  Sink& out_;
  TimeNs known_until_;
  Summary summary_;
  std::vector<Event> events_;
  std::vector<Eigen::Vector3f> event_points_;
  std::vector<SE3> object_poses_;
  Sample truth_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

Simulator::Simulator(World& world, Sink& out) : world_(world), run_(std::make_unique<Run>(world, out)) {
  out.begin(world.info);
}

Simulator::~Simulator() = default;

bool Simulator::advance_until(TimeNs t, const Monitor& monitor) {
  const TimeNs known = std::min({t, world_.trajectory->end(), world_.info.end});
  run_->know(known);
  while (CameraChannel* camera = camera_due(world_, known)) {  // the camera whose next sample comes first
    run_->advance(*camera);                                    // take it, start the one after it, cross the thresholds
    run_->deliver(watermark(world_));                          // write what is now certain, in order of time
    if (!monitor(run_->progress())) return false;
  }
  run_->deliver_imu_until(known);
  return true;
}

Summary Simulator::finish() { return run_->finish(camera_due(world_, world_.info.end) == nullptr); }

Summary simulate(World& world, Sink& out, const Monitor& monitor) {
  Simulator simulator(world, out);
  bool anything = false;
  std::string problem;
  try {
    simulator.advance_until(world.info.end, [&](const Progress& progress) {
      anything |= progress.now > progress.start;
      return monitor(progress);
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
