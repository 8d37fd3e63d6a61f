#pragma once

#include <vector>

#include "esim/recording/record.h"
#include "esim/sim/stages.h"
#include "esim/sim/summary.h"
#include "esim/sim/world.h"

namespace esim::inline sim {

/// Passes the records of a simulation to a sink: events, frames, measurements of the IMU, poses and ground truth, all
/// kinds together in order of time. Counts them in the summary.
class Delivery {
 public:
  /// All must outlive this object.
  Delivery(World& world, Sink& out, Stages& stages, Summary& summary)
      : world_(world), out_(out), stages_(stages), summary_(summary) {}

  /// Writes all records up to `until`, the time before which every camera's segments are known. Records at the same
  /// time: events, IMU, pose, ground truth, frames.
  void deliver_until(TimeNs until);

  /// Writes only the IMU's measurements up to `until`; the other records have to wait for the cameras.
  void deliver_imu_until(TimeNs until);

 private:
  /// The time of the next record except events. A frame is due when its exposure ends.
  TimeNs due() const;
  TimeNs imu_due() const;

  // Each writes the records of one kind for all cameras: events up to `until`, others at their due time t.
  void deliver_events(TimeNs until);
  void deliver_events(CameraChannel& camera, EventSensor& sensor, SensorSummary& summary);
  void deliver_imu(TimeNs t);
  void deliver_pose(TimeNs t);
  void deliver_truth(TimeNs t);
  void deliver_frames(TimeNs t);

  void write(const Record& record) { stages_.write(out_, record); }

  World& world_;
  Sink& out_;
  Stages& stages_;
  Summary& summary_;

  // Buffers.
  std::vector<EventLabel> labels_;
  std::vector<Eigen::Vector3f> event_points_;
  std::vector<SE3> object_poses_;
  Sample truth_;
};

}  // namespace esim::inline sim
