#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "esim/core/time.h"
#include "esim/geometry/se3.h"

namespace esim::inline motion {

struct TimedPose {
  TimeNs t = 0;
  SE3 T_world_body;
};

/// Why a list of poses is not a valid motion, and the pose at which the fault is found.
struct StampFault {
  std::size_t pose = 0;
  std::string message;
};

/// A gap of more than this many median intervals is a fault. With the default knots (up to four median intervals apart)
/// a control point of a spline of order 5 would influence no pose.
inline constexpr int kLargestGapInMedians = 20;

/// The first duplicated or unsorted stamp, or otherwise the first gap that is too large. Stamps need not be uniform.
std::optional<StampFault> find_stamp_fault(std::span<const TimedPose> poses);

/// The median of the intervals between successive stamps (the upper one of an even number). Needs two poses.
TimeNs median_interval(std::span<const TimedPose> poses);

}  // namespace esim::inline motion
