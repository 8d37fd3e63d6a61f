#include "esim/sim/delivery.h"

#include <algorithm>

#include "esim/motion/imu_kinematics.h"

namespace esim::inline sim {

void Delivery::deliver_until(TimeNs until) {
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

void Delivery::deliver_imu_until(TimeNs until) {
  while (imu_due() <= until) deliver_imu(imu_due());
}

TimeNs Delivery::imu_due() const { return world_.imu ? world_.imu->clock.due() : PeriodicClock::kNever; }

TimeNs Delivery::due() const {
  TimeNs due = std::min({world_.truth_clock.due(), world_.pose_clock.due(), imu_due()});
  for (const CameraChannel& camera : world_.cameras) {
    if (camera.frame_camera) due = std::min(due, camera.frame_camera->due());
  }
  return due;
}

void Delivery::deliver_events(TimeNs until) {
  for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
    CameraChannel& camera = world_.cameras[i];
    stages_.release_events(camera, until);
    for (std::size_t k = 0; k < camera.event_sensors.size(); ++k) {
      EventSensor& sensor = camera.event_sensors[k];
      if (!sensor.events.empty()) deliver_events(camera, sensor, summary_.cameras[i].sensors[k]);
    }
    stages_.forget_seen_objects(camera);
  }
}

void Delivery::deliver_events(CameraChannel& camera, EventSensor& sensor, SensorSummary& summary) {
  const auto on = std::ranges::count_if(sensor.events, [](const Event& e) { return e.polarity > 0; });
  summary.events_on += on;
  summary.events_off += static_cast<std::int64_t>(sensor.events.size()) - on;
  stages_.label_events(camera, sensor, labels_);
  write(EventsRecord{sensor.number, sensor.events, labels_});
  if (!camera.event_points) return;
  stages_.locate_events(camera, sensor.events, event_points_);
  write(EventPointsRecord{sensor.number, sensor.events, event_points_});
}

void Delivery::deliver_imu(TimeNs t) {
  ImuChannel& imu = *world_.imu;
  const InertialSignals truth =
      inertial_signals(world_.trajectory->at(t), imu.T_body_imu, imu.sensor.options().gravity);
  write(ImuRecord{t, imu.sensor.measure(t, truth), imu.sensor.bias(t)});
  ++summary_.imu_samples;
  imu.clock.advance();
}

void Delivery::deliver_pose(TimeNs t) {
  PoseRecord pose{t, world_.trajectory->at(t)};
  for (const auto& object : world_.objects) pose.objects.push_back(object->at(t));
  if (world_.imu) pose.imu_bias = world_.imu->sensor.bias(t);
  write(pose);
  world_.pose_clock.advance();
}

void Delivery::deliver_truth(TimeNs t) {
  for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
    const int number = static_cast<int>(i);
    RenderRequest request = view(world_, i, t);
    const std::optional<Flicker>& flicker = world_.cameras[i].flicker;
    request.which_objects = world_.truth_objects || (flicker && flicker->light().has_sources());
    object_poses_.clear();
    for (const Kinematics& object : request.objects) object_poses_.push_back(object.T_world_body);
    const OpticalFlowImages* const optical_flow = stages_.render_truth(world_.cameras[i], request, truth_);
    write(TruthRecord{number, t, request.camera.T_world_body, truth_.irradiance, truth_.depth, truth_.motion_x,
                      truth_.motion_y, world_.truth_objects ? &truth_.object : nullptr, object_poses_});
    if (optical_flow != nullptr) {
      write(OpticalFlowRecord{number, optical_flow->t0, optical_flow->t1, optical_flow->x, optical_flow->y,
                              optical_flow->visible});
    }
    ++summary_.truth_frames;
  }
  world_.truth_clock.advance();
}

void Delivery::deliver_frames(TimeNs t) {
  for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
    std::optional<FrameCamera>& camera = world_.cameras[i].frame_camera;
    if (!camera || camera->due() != t) continue;
    const CameraFrame frame = camera->take();
    write(FrameRecord{static_cast<int>(i), frame.t, frame.exposure_start, frame.exposure, camera->options().gain,
                      frame.numbers, camera->options().bits});
    ++summary_.cameras[i].frames;
  }
}

}  // namespace esim::inline sim
