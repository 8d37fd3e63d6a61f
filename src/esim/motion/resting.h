#pragma once

#include <memory>

#include "esim/motion/trajectory.h"

namespace esim {

/// A motion that stops at its end, and rests there until `end`.
class RestingTrajectory final : public Trajectory {
 public:
  /// Throws InternalError where `end` comes before the motion's.
  RestingTrajectory(std::shared_ptr<const Trajectory> motion, TimeNs end);

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return motion_->start(); }
  TimeNs end() const override { return end_; }

 private:
  std::shared_ptr<const Trajectory> motion_;
  TimeNs end_;
};

}  // namespace esim
