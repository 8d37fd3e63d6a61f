#include "esim/reproject/frames/pose_path.h"

#include "esim/geometry/so3.h"

namespace esim::inline reproject {
namespace {

/// The coefficients of a dt + b dt^2 through `before` at -earlier and `after` at later; both intervals are positive.
void fit_quadratic(const Eigen::Vector3d& before, double earlier, const Eigen::Vector3d& after, double later,
                   Eigen::Vector3d& a, Eigen::Vector3d& b) {
  b = (after / later + before / earlier) / (later + earlier);
  a = after / later - b * later;
}

}  // namespace

PosePath::PosePath(const PoseAt& first, const PoseAt& second)
    : first_(first.pose), t_(first.t), curve_(Eigen::Vector3d::Zero()), turn_curve_(curve_) {
  const auto later = static_cast<double>(second.t - first.t);
  velocity_ = (second.pose.translation - first_.translation) / later;
  turn_ = so3_log(first_.rotation.conjugate() * second.pose.rotation) / later;
}

PosePath::PosePath(const PoseAt& earlier, const PoseAt& first, const PoseAt& second) : PosePath(first, second) {
  const auto before = static_cast<double>(first.t - earlier.t), after = static_cast<double>(second.t - first.t);
  fit_quadratic(earlier.pose.translation - first_.translation, before, second.pose.translation - first_.translation,
                after, velocity_, curve_);
  fit_quadratic(so3_log(first_.rotation.conjugate() * earlier.pose.rotation), before,
                so3_log(first_.rotation.conjugate() * second.pose.rotation), after, turn_, turn_curve_);
}

SE3 PosePath::at(TimeNs t) const {
  const auto dt = static_cast<double>(t - t_);
  return {(first_.rotation * so3_exp(dt * turn_ + dt * dt * turn_curve_)).normalized(),
          first_.translation + dt * velocity_ + dt * dt * curve_};
}

}  // namespace esim::inline reproject
