#pragma once

#include <optional>
#include <span>
#include <vector>

#include "esim/geometry/bezier.h"
#include "esim/motion/trajectory.h"

namespace esim {

/// A pose that a body passes through.
struct Waypoint {
  SE3 T_world_body;
  std::optional<double> t_s{};          ///< when it is reached; of all points or of none
  std::optional<double> speed_m_per_s;  ///< from it to the next point, where not that of the options
  double pause_s = 0.0;                 ///< for which the body stands still there
};

struct WaypointOptions {
  double speed_m_per_s = 1.0;   ///< where points have no times: mean speed along the path
  double turn_rad_per_s = 0.8;  ///< where points have no times: mean rate of turning that is not exceeded
  double ramp_s = 0.5;          ///< for which the body gathers speed after standing still, and loses it before
  bool rest = true;             ///< stands still at the start and at the end
  bool closed = false;          ///< returns to the first point
};

/// A smooth motion through poses, with twist and acceleration continuous throughout.
///
/// Between two stops the path is an interpolating spline (waypoint_path.h); what does not change from one point to the
/// next stands still there. The body stops at the ends (`rest`), where it pauses, and before and after turning on the
/// spot; a path may have a corner at a stop. There the path's parameter τ follows a clock with τ̇ = 3 x² − 2 x³,
/// x = t/ramp, from 0 to 1.
///
/// With times, each point is reached exactly when it says, and left after its pause; a ramp takes at most a third of
/// its leg. With speeds, a leg lasts length/speed or angle/turn rate, whichever is longer, measured along the curve,
/// and half of each ramp more; the motion starts at 0.
class WaypointTrajectory final : public Trajectory {
 public:
  /// Throws UserError, naming the point as "points.INDEX", for fewer than two, poses that are not finite or whose
  /// quaternion has not unit norm, times that do not increase, are of some points only or stand beside speeds, pauses
  /// that last beyond the next point's time, points without times that are where the one before is, options out of
  /// range, and `closed` with times.
  WaypointTrajectory(std::span<const Waypoint> points, const WaypointOptions& options);

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return start_; }
  TimeNs end() const override { return end_; }

  /// When each point is reached; of a closed motion also the first one again.
  std::vector<TimeNs> arrivals() const;

 private:
  /// From one point to the next.
  struct Leg {
    TimeNs leave = 0, arrive = 0;
    double ramp_in_s = 0.0, ramp_out_s = 0.0;
    QuinticBezier path;
  };

  TimeNs start_ = 0, end_ = 0;
  std::vector<Leg> legs_;
};

}  // namespace esim
