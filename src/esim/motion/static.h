#pragma once

#include "esim/motion/trajectory.h"

namespace esim::inline motion {

/// A body at rest for a given time.
class StaticTrajectory final : public Trajectory {
 public:
  /// Throws InternalError for a negative duration.
  StaticTrajectory(const SE3& T_world_body, TimeNs start, TimeNs duration);

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return start_; }
  TimeNs end() const override { return end_; }

 private:
  Kinematics kinematics_;
  TimeNs start_;
  TimeNs end_;
};

}  // namespace esim::inline motion
