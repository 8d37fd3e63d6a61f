#pragma once

#include <Eigen/Core>
#include <vector>

#include "esim/motion/trajectory.h"

namespace esim {

struct OnlineMotionOptions {
  TimeNs start = 0;
  TimeNs interval = 5 * kNsPerMs;  ///< between two pushed poses
  int order = 4;                   ///< of the spline: 4 (cubic; one interval of latency) or 6 (quintic; two)
};

/// A motion that becomes known while it is used: a uniform B-spline whose control poses are pushed one by one, each
/// the pose of the body `interval` after the one before. Before that the body rests at the initial pose, until
/// newest(), which is latency() after the start.
///
/// What the spline does at a time depends on the poses up to latency() = (order/2 − 1) intervals later: up to
/// final_until() = newest() − latency() the motion is final, and later pushes leave at(t) the same bit for bit. The
/// spline does not pass through the poses, but near them: a cubic one by about interval²/6 times the acceleration (40
/// µm for 10 m/s² at 200 Hz), and its acceleration at a pose's time is the second difference of the poses.
///
/// Pushing must not run concurrently with at().
class OnlineTrajectory final : public Trajectory {
 public:
  /// Throws UserError for an interval that is not positive, an order other than 4 and 6, and a pose that push()
  /// refuses.
  OnlineTrajectory(const OnlineMotionOptions& options, const SE3& T_world_body);

  /// The pose at newest() + interval. Throws UserError unless it is finite with a rotation of unit norm, by less than
  /// 180° from the last one.
  void push(const SE3& T_world_body);

  /// The pose that a body reaches from the newest one under a constant acceleration (world frame, m/s², without
  /// gravity) and angular rate (body frame, rad/s). The velocity at the start is 0; after push() it is the mean one
  /// since the pose before.
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

}  // namespace esim
