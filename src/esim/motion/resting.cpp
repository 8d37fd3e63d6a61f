#include "esim/motion/resting.h"

#include <fmt/format.h>

#include <utility>

#include "esim/core/error.h"

namespace esim::inline motion {

RestingTrajectory::RestingTrajectory(std::shared_ptr<const Trajectory> motion, TimeNs end)
    : motion_(std::move(motion)), end_(end) {
  if (end_ < motion_->end())
    throw InternalError(fmt::format("resting trajectory: {} ns is before the motion's end", end_));
}

Kinematics RestingTrajectory::at(TimeNs t) const {
  require_covered(t);
  if (t <= motion_->end()) return motion_->at(t);
  Kinematics at_rest;
  at_rest.T_world_body = motion_->at(motion_->end()).T_world_body;
  return at_rest;
}

}  // namespace esim::inline motion
