#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "esim/geometry/so3.h"
#include "esim/motion/timed_pose.h"

namespace esim::test {

inline constexpr TimeNs kEpoch = 1'403'715'273'262'142'976;

using Motion = std::function<SE3(double)>;

/// `count` poses of a motion from 0 to duration_s, with every inner stamp moved by up to `jitter` of the interval.
inline std::vector<TimedPose> sample(const Motion& motion, int count, double duration_s, double jitter = 0.0) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-jitter, jitter);
  std::vector<TimedPose> poses;
  for (int i = 0; i < count; ++i) {
    const double shift = i == 0 || i == count - 1 ? 0.0 : uniform(engine);
    const TimeNs t = to_ns(duration_s * (i + shift) / (count - 1));
    poses.push_back({kEpoch + t, motion(to_seconds(t))});
  }
  return poses;
}

/// A motion like that of a hand-held camera: a few sinusoids of up to 2 Hz.
inline SE3 smooth_motion(double t) {
  const Eigen::Vector3d turn(0.5 * std::sin(3.0 * t), 0.3 * std::cos(7.0 * t), 0.4 * std::sin(11.0 * t + 1.0));
  return {so3_exp(turn), {std::sin(4.0 * t), 0.5 * std::cos(9.0 * t), 2.0 + 0.2 * std::sin(12.0 * t)}};
}

inline std::vector<TimedPose> with_noise(std::vector<TimedPose> poses, double sigma) {
  std::mt19937 engine(6);
  std::normal_distribution<double> normal(0.0, sigma);
  for (TimedPose& pose : poses) {
    pose.T_world_body.translation += Eigen::Vector3d(normal(engine), normal(engine), normal(engine));
    const Eigen::Vector3d turn(normal(engine), normal(engine), normal(engine));
    pose.T_world_body.rotation = pose.T_world_body.rotation * so3_exp(turn);
  }
  return poses;
}

}  // namespace esim::test
