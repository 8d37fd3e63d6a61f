#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "esim/core/parallel.h"
#include "esim/event_camera/event_camera.h"
#include "esim/frame_camera/frame_camera.h"
#include "esim/imu/imu.h"
#include "esim/light/flicker.h"
#include "esim/motion/trajectory.h"
#include "esim/recording/record.h"
#include "esim/render/deforming_surfaces.h"
#include "esim/render/renderer.h"
#include "esim/sampling/sampler.h"
#include "esim/sim/flicker_labels.h"
#include "esim/truth/clock.h"
#include "esim/truth/event_points.h"
#include "esim/truth/optical_flow.h"
#include "esim/truth/seen_objects.h"

namespace esim::inline sim {

/// One event sensor of a camera.
struct EventSensor {
  EventCamera event_camera;
  int number = 0;                                 // of its records' camera in RecordingInfo::cameras
  std::optional<FlickerLabels> flicker_labels{};  // if it has labels and the light flickers
  EventSpan events{};                             // the latest ones, on their way to the sink
};

/// One camera of the rig with its renderer, sampler and sensors. All sensors see the same samples.
struct CameraChannel {
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<Sampler> sampler;
  std::vector<EventSensor> event_sensors{};
  Sample sample{};                         // the latest sample; renderer and sampler exchange its buffers
  std::unique_ptr<Rendering> rendering{};  // the running rendering of the sampler's next request
  std::optional<FrameCamera> frame_camera{};
  std::optional<Flicker> flicker{};  // unset: constant light

  /// If set, takes what the event sensors see, as EventCamera::integrate() does.
  std::function<void(std::span<const Segment> segments, TimeNs watermark)> keep_samples{};

  // Ground truth, if requested.
  std::unique_ptr<OpticalFlowFromDepth> optical_flow{};
  std::unique_ptr<EventPoints> event_points{};

  std::optional<SeenObjects> seen_objects{};  // for labels, if anything moves
};

/// The rig's inertial measurement unit.
struct ImuChannel {
  Imu sensor;
  SE3 T_body_imu;
  PeriodicClock clock;
};

/// The state of a simulation. Its description is a RecordingInfo, which does not change.
struct World {
  RecordingInfo info;
  std::unique_ptr<const Workers> workers;                  // outlives the channels
  std::shared_ptr<const Trajectory> trajectory;            // of the body
  std::vector<std::shared_ptr<const Trajectory>> objects;  // of the scene's moving objects, in its order
  std::shared_ptr<const DeformingSurfaces> deforming;      // of those that deform; null if all are rigid
  std::vector<CameraChannel> cameras;                      // the first of info.cameras; then come event sensors
  PeriodicClock truth_clock, pose_clock;
  std::optional<ImuChannel> imu{};
  bool truth_objects = false;  // whether ground truth has the object of each pixel
};

/// The poses of a camera of the world and of the moving objects at a time, without tiles, as a function that may
/// outlive the world. While the body's motion at that time is not known yet, its last known pose.
std::function<RenderRequest(TimeNs)> view_at(const World& world, std::size_t camera);

/// The request to render `tiles` of a camera of the world at `t`; evaluates the motions.
RenderRequest view(const World& world, std::size_t camera, TimeNs t, std::vector<Tile> tiles);

/// The same for the complete image.
RenderRequest view(const World& world, std::size_t camera, TimeNs t);

}  // namespace esim::inline sim
