#pragma once

#include "estimator.h"
#include "vehicle.h"

/// A point of the commanded path.
struct Waypoint {
  Eigen::Vector3d position, velocity, acceleration;
};

/// A lying figure eight around `centre`, 4 m by 2 m, begun from rest; `t_s` after the start.
Waypoint figure_eight(const Eigen::Vector3d& centre, double t_s);

/// What steers the vehicle onto the path, looking along x, by what is estimated.
Command steer(const Waypoint& goal, const Estimator& estimate);
