#include "esim/walk/walker.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace esim::inline walk {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kStep_s = 0.1;  // each key press moves for this time
constexpr double kTurn_rad = 5.0 * kDegree;
constexpr double kLargestPitch_rad = 89.0 * kDegree;
constexpr double kFaster = 1.25;
constexpr double kSlowest_m_per_s = 0.01, kFastest_m_per_s = 100.0;

}  // namespace

Walker::Walker(const SE3& T_world_camera, double speed_m_per_s) : speed_m_per_s_(speed_m_per_s) {
  stand_at(T_world_camera);
}

void Walker::stand_at(const SE3& T_world_camera) {
  position_ = T_world_camera.translation;
  const Eigen::Vector3d direction = T_world_camera.rotation * Eigen::Vector3d::UnitZ();
  const double level = std::hypot(direction.x(), direction.y());
  // If it looks straight up or down, the upward direction of the image gives the heading.
  const Eigen::Vector3d heading =
      level > 1e-6 ? direction : -direction.z() * (T_world_camera.rotation * -Eigen::Vector3d::UnitY());
  yaw_rad_ = std::atan2(heading.y(), heading.x());
  pitch_rad_ = std::clamp(std::atan2(direction.z(), level), -kLargestPitch_rad, kLargestPitch_rad);
}

SE3 Walker::T_world_camera() const {
  const double c = std::cos(yaw_rad_), s = std::sin(yaw_rad_);
  const Eigen::Vector3d z(std::cos(pitch_rad_) * c, std::cos(pitch_rad_) * s, std::sin(pitch_rad_)), x(s, -c, 0.0);
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return {Eigen::Quaterniond(R).normalized(), position_};
}

Walker::Effect Walker::step(double forward, double left, double up) {
  const double c = std::cos(yaw_rad_), s = std::sin(yaw_rad_);
  position_ += speed_m_per_s_ * kStep_s * Eigen::Vector3d(forward * c - left * s, forward * s + left * c, up);
  return Effect::moved;
}

Walker::Effect Walker::turn(double left_steps, double up_steps) {
  yaw_rad_ = std::remainder(yaw_rad_ + left_steps * kTurn_rad, 2.0 * std::numbers::pi);
  pitch_rad_ = std::clamp(pitch_rad_ + up_steps * kTurn_rad, -kLargestPitch_rad, kLargestPitch_rad);
  return Effect::moved;
}

Walker::Effect Walker::go_to_next() {
  if (points_.empty()) return Effect::nothing;
  stand_at(points_[next_ % points_.size()]);
  next_ = (next_ + 1) % points_.size();
  return Effect::moved;
}

Walker::Effect Walker::press(Key key) {
  switch (key) {
    case Key::forward:
      return step(1, 0, 0);
    case Key::back:
      return step(-1, 0, 0);
    case Key::left:
      return step(0, 1, 0);
    case Key::right:
      return step(0, -1, 0);
    case Key::up:
      return step(0, 0, 1);
    case Key::down:
      return step(0, 0, -1);
    case Key::turn_left:
      return turn(1, 0);
    case Key::turn_right:
      return turn(-1, 0);
    case Key::look_up:
      return turn(0, 1);
    case Key::look_down:
      return turn(0, -1);
    case Key::faster:
      speed_m_per_s_ = std::min(speed_m_per_s_ * kFaster, kFastest_m_per_s);
      return Effect::speed_changed;
    case Key::slower:
      speed_m_per_s_ = std::max(speed_m_per_s_ / kFaster, kSlowest_m_per_s);
      return Effect::speed_changed;
    case Key::drop: {
      const SE3 here = T_world_camera();
      if (!points_.empty() && (points_.back().translation - here.translation).norm() < 1e-6 &&
          points_.back().rotation.angularDistance(here.rotation) < 1e-6) {
        return Effect::stands_there;
      }
      points_.push_back(here);
      return Effect::dropped;
    }
    case Key::undo:
      if (points_.empty()) return Effect::nothing;
      points_.pop_back();
      return Effect::removed;
    case Key::next:
      return go_to_next();
    case Key::preview:
      return Effect::preview;
    case Key::play:
      return Effect::play;
    case Key::help:
      return Effect::help;
    case Key::leave:
      return Effect::leave;
  }
  return Effect::nothing;
}

}  // namespace esim::inline walk
