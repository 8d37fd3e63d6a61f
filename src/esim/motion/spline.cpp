#include "esim/motion/spline.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline motion {

SplineTrajectory::SplineTrajectory(Se3Spline spline, TimeNs start, TimeNs end)
    : spline_(std::move(spline)), start_(start), end_(end) {
  // The spline may be shorter by half a nanosecond and the rounding of seconds.
  const double spline_duration_s = spline_.end_s() - spline_.start_s();
  const double slack_s = 0.5e-9 + 1e-12 * spline_duration_s;
  if (end < start || to_seconds(end - start) > spline_duration_s + slack_s) {
    throw InternalError(fmt::format("spline trajectory: [{}, {}] ns does not fit in a spline of {:.9f} s", start, end,
                                    spline_duration_s));
  }
}

Kinematics SplineTrajectory::at(TimeNs t) const {
  require_covered(t);
  const SplineValue value = spline_.at(std::min(spline_.start_s() + to_seconds(t - start_), spline_.end_s()));
  return {value.pose, value.velocity, value.acceleration, value.angular_velocity, value.angular_acceleration};
}

}  // namespace esim::inline motion
