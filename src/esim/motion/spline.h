#pragma once

#include "esim/geometry/bspline.h"
#include "esim/motion/trajectory.h"

namespace esim::inline motion {

/// The motion along a B-spline.
class SplineTrajectory final : public Trajectory {
 public:
  /// The spline begins at the instant `start`; its part after `end` is not used. Throws InternalError if end < start or
  /// the spline ends before `end`.
  SplineTrajectory(Se3Spline spline, TimeNs start, TimeNs end);

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return start_; }
  TimeNs end() const override { return end_; }

  const Se3Spline& spline() const { return spline_; }

 private:
  Se3Spline spline_;
  TimeNs start_;
  TimeNs end_;
};

}  // namespace esim::inline motion
