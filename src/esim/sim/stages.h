#pragma once

#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/sim/summary.h"
#include "esim/sim/world.h"

namespace esim::inline sim {

/// The work of a simulation, in the stages by which its time is reported: every function adds its wall-clock time to
/// one member of StageSeconds. The functions decide nothing; simulate.cpp and delivery.cpp say when they are called.
class Stages {
 public:
  /// Both must outlive this object.
  Stages(World& world, StageSeconds& seconds) : world_(world), seconds_(seconds) {}

  // --- render
  /// Starts to render what the camera's sampler requests next, unless some of it is after `known_until`. On a graphics
  /// card, the rendering then continues in parallel.
  void start_rendering(CameraChannel& camera, TimeNs known_until);
  /// Waits for the rendering, which becomes the camera's latest sample.
  void finish_rendering(CameraChannel& camera);

  // --- sampling
  /// The first segments that the latest sample completes.
  std::span<const Segment> accept_sample(CameraChannel& camera);
  /// The next ones; none after the last.
  std::span<const Segment> more_segments(CameraChannel& camera);

  /// If the light flickers: finds out which light the segments' pixels see, for make_events() and expose_frames().
  void look_at_lights(CameraChannel& camera, std::span<const Segment> segments);

  // --- events
  /// Gives segments to all event sensors, divided if the light flickers, and keeps them if requested.
  void make_events(CameraChannel& camera, std::span<const Segment> segments);
  /// Replaces EventSensor::events of each sensor by its next ones up to `until`.
  void release_events(CameraChannel& camera, TimeNs until);

  // --- frames
  /// Gives segments to the frame camera, if there is one; without segments, only the sampler's watermark.
  void expose_frames(CameraChannel& camera, std::span<const Segment> segments);

  // --- truth
  /// Renders the ground truth of a camera in the light of that time. Returns the optical flow from the previous one;
  /// null if not requested, and for the first one.
  const OpticalFlowImages* render_truth(CameraChannel& camera, const RenderRequest& request, Sample& truth);
  /// The labels of EventSensor::events, with the objects that the pixels saw; none unless the sensor has labels.
  void label_events(CameraChannel& camera, EventSensor& sensor, std::vector<EventLabel>& labels);
  /// Forgets the objects that are needed for no later label of any sensor, if they are many.
  void forget_seen_objects(CameraChannel& camera);
  /// The scene points of events, in their order.
  void locate_events(CameraChannel& camera, std::span<const Event> events, std::vector<Eigen::Vector3f>& points);

  // --- write
  void write(Sink& out, const Record& record);
  void end(Sink& out, bool complete);

 private:
  /// Calls work(sensor, workers) for each sensor of a camera: several at the same time, each on one thread, if they are
  /// enough for all threads, otherwise one after the other, each on all threads.
  template <typename Work>
  void for_each_sensor(CameraChannel& camera, const Work& work);

  World& world_;
  StageSeconds& seconds_;
  Workers one_thread_{1};
};

}  // namespace esim::inline sim
