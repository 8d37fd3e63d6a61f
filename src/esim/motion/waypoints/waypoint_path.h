#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "esim/geometry/bezier.h"

namespace esim::inline motion {

/// The poses of a path and the legs between them: leg i leads from node i to node i + 1.
struct WaypointCourse {
  std::vector<SE3> nodes;
  std::vector<bool> stops;    ///< per node: the path may have a corner there
  bool periodic = false;      ///< smooth from the last node to the first, which is the same pose
  std::vector<double> leg_s;  ///< how long each leg takes

  std::size_t legs() const { return nodes.size() - 1; }
  Eigen::Vector3d displacement(std::size_t leg) const;
  Eigen::Vector3d turn(std::size_t leg) const;  ///< rotation vector in the world frame, at most a half turn
};

/// A curve for each leg. Between stops, velocities and accelerations are continuous: those of the C² cubic spline of
/// positions and, by the same equations for world-frame rates, of rotations. If a leg is so much slower than its
/// neighbour that the rate at their joint exceeds twice its mean, the rate is reduced to that and its derivative set
/// to zero; otherwise the spline would overshoot the point and return.
std::vector<QuinticBezier> smooth_path(const WaypointCourse& course);

}  // namespace esim::inline motion
