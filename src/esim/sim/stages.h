#pragma once

#include <span>
#include <vector>

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
  /// Gives segments to the event camera, if there is one, divided if the light flickers.
  void make_events(CameraChannel& camera, std::span<const Segment> segments);
  /// Replaces `events` by the next events of the event camera up to `until`.
  void release_events(CameraChannel& camera, TimeNs until, std::vector<Event>& events);

  // --- frames
  /// Gives segments to the frame camera, if there is one; without segments, only the sampler's watermark.
  void expose_frames(CameraChannel& camera, std::span<const Segment> segments);

  // --- truth
  /// Renders the ground truth of a camera in the light of that time. Returns the optical flow from the previous one;
  /// null if not requested, and for the first one.
  const OpticalFlowImages* render_truth(CameraChannel& camera, const RenderRequest& request, Sample& truth);
  /// The labels of the events that release_events() returned last, with the objects that the pixels saw; none unless
  /// the event camera has labels.
  void label_events(CameraChannel& camera, std::span<const Event> events, std::vector<EventLabel>& labels);
  /// The scene points of events, in their order.
  void locate_events(CameraChannel& camera, std::span<const Event> events, std::vector<Eigen::Vector3f>& points);

  // --- write
  void write(Sink& out, const Record& record);
  void end(Sink& out, bool complete);

 private:
  World& world_;
  StageSeconds& seconds_;
};

}  // namespace esim::inline sim
