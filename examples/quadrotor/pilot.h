#pragma once

#include "estimator.h"
#include "vehicle.h"

/// A point of the commanded path.
struct Waypoint {
  Eigen::Vector3d position, velocity, acceleration;
};

/// A horizontal figure eight around `centre`, 4 m by 2 m, from rest, at `t_s` after the start.
Waypoint figure_eight(const Eigen::Vector3d& centre, double t_s);

/// The command that steers the estimated vehicle onto the path, facing along x.
Command steer(const Waypoint& goal, const Estimator& estimate);
