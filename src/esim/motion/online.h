#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/motion/trajectory.h"

namespace esim::inline motion {

struct OnlineMotionOptions {
  TimeNs start = 0;
  TimeNs interval = 5 * kNsPerMs;  ///< between two pushed poses
  int order = 4;                   ///< of the spline: 4 (cubic; one interval of latency) or 6 (quintic; two)
};

/// A motion that is extended while it is used: a uniform B-spline whose control poses are pushed one by one, each
/// `interval` after the previous one. Until newest(), which is initially latency() after the start, the body rests at
/// the initial pose.
///
/// The spline at a time depends on the poses up to latency() = (order/2 − 1) intervals later. The motion is final up to
/// final_until() = newest() − latency(): later pushes do not change a single bit of at(t). The spline passes near the
/// poses, not through them: a cubic spline misses them by about interval²/6 times the acceleration (40 µm for 10 m/s²
/// at 200 Hz), and its acceleration at a pose's time is the second difference of the poses.
///
/// Pushing must not run concurrently with at().
class OnlineTrajectory final : public Trajectory {
 public:
  /// Throws UserError for an interval that is not positive, an order other than 4 or 6, and a pose that push()
  /// rejects.
  OnlineTrajectory(const OnlineMotionOptions& options, const SE3& T_world_body);

  /// Adds the pose at newest() + interval. Throws UserError unless it is finite, with a quaternion of unit norm, and
  /// rotated by less than 180° from the last one.
  void push(const SE3& T_world_body);

  /// Adds the pose that a body reaches from the newest one under a constant acceleration (world frame, m/s², without
  /// gravity) and angular rate (body frame, rad/s). The velocity is initially 0; after push() it is the mean velocity
  /// since the previous pose.
  void push_motion(const Eigen::Vector3d& acceleration_world, const Eigen::Vector3d& omega_body);

  TimeNs newest() const;
  TimeNs latency() const { return (options_.order / 2 - 1) * options_.interval; }
  TimeNs final_until() const { return newest() - latency(); }

  Kinematics at(TimeNs t) const override;
  TimeNs start() const override { return options_.start; }

  /// final_until().
  TimeNs end() const override { return final_until(); }

 private:
  OnlineMotionOptions options_;
  std::vector<SE3> controls_;  // the first order − 1 are the initial pose
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace esim::inline motion
