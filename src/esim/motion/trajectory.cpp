#include "esim/motion/trajectory.h"

#include <fmt/format.h>

#include "esim/core/error.h"

namespace esim::inline motion {

void Trajectory::require_covered(TimeNs t) const {
  if (t < start() || t > end()) {
    throw InternalError(fmt::format("time {} ns is outside the trajectory's [{}, {}] ns", t, start(), end()));
  }
}

}  // namespace esim::inline motion
