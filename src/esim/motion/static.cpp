#include "esim/motion/static.h"

#include <fmt/format.h>

#include "esim/core/error.h"

namespace esim::inline motion {

StaticTrajectory::StaticTrajectory(const SE3& T_world_body, TimeNs start, TimeNs duration)
    : start_(start), end_(start + duration) {
  if (duration < 0) throw InternalError(fmt::format("static trajectory: the duration is {} ns", duration));
  kinematics_.T_world_body = T_world_body;
}

Kinematics StaticTrajectory::at(TimeNs t) const {
  require_covered(t);
  return kinematics_;
}

}  // namespace esim::inline motion
