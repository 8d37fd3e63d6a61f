#pragma once

#include <memory>

#include "esim/motion/trajectory.h"

namespace esim::inline motion {

/// A motion that rests at its last pose until `end`.
class RestingTrajectory final : public Trajectory {
 public:
  /// Throws InternalError if `end` is before the end of the motion.
  RestingTrajectory(std::shared_ptr<const Trajectory> motion, TimeNs end);

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return motion_->start(); }
  TimeNs end() const override { return end_; }

 private:
  std::shared_ptr<const Trajectory> motion_;
  TimeNs end_;
};

}  // namespace esim::inline motion
