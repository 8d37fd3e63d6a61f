#pragma once

#include <cstddef>
#include <vector>

#include "esim/geometry/se3.h"
#include "esim/walk/keys.h"

namespace esim::inline walk {

/// A camera that moves through a scene by keys, and its waypoints. The camera stays level: its x axis is horizontal
/// (world z is up), and its pitch is at most ±89°.
class Walker {
 public:
  /// The effect of a key, or an action that the caller must perform.
  enum class Effect {
    nothing,
    moved,          ///< also to a waypoint
    speed_changed,  ///< of the steps
    dropped,        ///< points() has one more
    stands_there,   ///< nothing was added: the last waypoint is here
    removed,        ///< points() has one fewer
    preview,
    play,
    help,
    leave,
  };

  /// Starts at a camera's pose without its roll.
  explicit Walker(const SE3& T_world_camera, double speed_m_per_s = 1.0);

  Effect press(Key key);

  /// Adds an existing waypoint.
  void add_point(const SE3& T_world_camera) { points_.push_back(T_world_camera); }

  SE3 T_world_camera() const;
  double yaw_rad() const { return yaw_rad_; }      ///< from world x to y
  double pitch_rad() const { return pitch_rad_; }  ///< upwards
  double speed_m_per_s() const { return speed_m_per_s_; }
  const std::vector<SE3>& points() const { return points_; }  ///< T_world_camera

 private:
  Effect step(double forward, double left, double up);
  Effect turn(double left_steps, double up_steps);
  Effect go_to_next();
  void stand_at(const SE3& T_world_camera);

  Eigen::Vector3d position_;
  double yaw_rad_ = 0.0, pitch_rad_ = 0.0;
  double speed_m_per_s_;
  std::vector<SE3> points_;
  std::size_t next_ = 0;
};

}  // namespace esim::inline walk
