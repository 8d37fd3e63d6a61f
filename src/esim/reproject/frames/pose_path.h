#pragma once

#include <vector>

#include "esim/core/time.h"
#include "esim/geometry/se3.h"

namespace esim::inline reproject {

/// A pose at a time.
struct PoseAt {
  TimeNs t = 0;
  SE3 pose;
};

/// Where a body is between two poses. With the pose before them, its motion is the quadratic polynomial through all
/// three, in position and in the rotation vector from the middle one; without, it is uniform.
class PosePath {
 public:
  /// From `first` to `second`, which is later.
  PosePath(const PoseAt& first, const PoseAt& second);
  PosePath(const PoseAt& earlier, const PoseAt& first, const PoseAt& second);

  /// The pose at a time from that of `first` to that of `second`.
  SE3 at(TimeNs t) const;

 private:
  SE3 first_;
  TimeNs t_;
  // Per ns and per ns^2: of the position, and of the rotation vector in the frame of the body at `first`.
  Eigen::Vector3d velocity_, curve_, turn_, turn_curve_;
};

}  // namespace esim::inline reproject
