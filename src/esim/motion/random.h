#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "esim/core/time.h"
#include "esim/motion/spline.h"

namespace esim::inline motion {

struct RandomMotionOptions {
  Eigen::Vector3d position_amplitude_m = Eigen::Vector3d::Zero();    // along the axes of `center`, ≥ 0
  Eigen::Vector3d rotation_amplitude_rad = Eigen::Vector3d::Zero();  // about the axes of the body, ≥ 0
  double knot_interval_s = 0.25;                                     // time between control points
  SE3 center;                                                        // T_world_body about which it moves
  int order = 5;                                                     // of the spline, 2 … 6
};

/// A smooth random motion: a uniform B-spline with independent random control points; control point j is
///   center · (Exp(a_x e_x) Exp(a_y e_y) Exp(a_z e_z), p),   a and p uniform in ± amplitude per axis,
/// with AddressedRandom(seed, trajectory_position or trajectory_rotation), item = axis, draw = j, and `stream` for the
/// moving body. A longer duration therefore only appends control points, and the amplitude of one axis does not affect
/// the others. The position stays within the amplitudes. Between successive control rotations the body makes the
/// shorter rotation: with amplitudes above 90° full turns can occur, but never more than 180° in one knot interval.
///
/// Throws UserError, naming the field, for amplitudes that are negative or not finite, an order outside 2 … 6, a knot
/// interval or a duration that is not positive, more than ten million control points, and a center whose rotation
/// does not have unit norm.
SplineTrajectory random_trajectory(const RandomMotionOptions& options, TimeNs start, TimeNs duration,
                                   std::uint64_t seed, std::uint16_t stream = 0);

}  // namespace esim::inline motion
