#pragma once

#include <optional>
#include <span>
#include <vector>

#include "esim/geometry/bezier.h"
#include "esim/motion/trajectory.h"

namespace esim::inline motion {

/// A pose that a body passes through.
struct Waypoint {
  SE3 T_world_body;
  std::optional<double> t_s{};          ///< arrival time; given for all points or for none
  std::optional<double> speed_m_per_s;  ///< to the next point, instead of that of the options
  double pause_s = 0.0;                 ///< how long the body rests there
};

struct WaypointOptions {
  double speed_m_per_s = 1.0;   ///< mean speed along the path, if points have no times
  double turn_rad_per_s = 0.8;  ///< maximum mean turn rate, if points have no times
  double ramp_s = 0.5;          ///< duration of acceleration after a rest, and of deceleration before one
  bool rest = true;             ///< the body rests at the start and at the end
  bool closed = false;          ///< the motion returns to the first point
};

/// A smooth motion through poses, with twist and acceleration continuous throughout.
///
/// Between two stops the path is an interpolating spline (waypoint_path.h); a position or orientation that is the same
/// at two successive points is constant between them. The body stops at the ends (`rest`), at pauses, and before and
/// after turning on the spot; a path may have a corner at a stop. At a stop, the path's parameter τ follows a clock
/// with τ̇ = 3 x² − 2 x³, x = t/ramp, from 0 to 1.
///
/// With times, the body reaches each point exactly at its time and leaves it after its pause; a ramp takes at most a
/// third of its leg. With speeds, a leg takes length/speed or angle/turn rate, whichever is longer, measured along the
/// curve, plus half of each ramp; the motion starts at 0.
class WaypointTrajectory final : public Trajectory {
 public:
  /// Throws UserError, naming the point as "points.INDEX", for fewer than two points, poses that are not finite or
  /// whose quaternion does not have unit norm, times that do not increase, times for some points only or together with
  /// speeds, pauses that end after the next point's time, points without times at the pose of the previous point,
  /// options out of range, and `closed` with times.
  WaypointTrajectory(std::span<const Waypoint> points, const WaypointOptions& options);

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return start_; }
  TimeNs end() const override { return end_; }

  /// The arrival time at each point, and for a closed motion also at the first one again.
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

}  // namespace esim::inline motion
