#pragma once

#include <span>

#include "esim/motion/spline.h"
#include "esim/motion/timed_pose.h"

namespace esim {

struct FitOptions {
  int order = 5;  // of the spline, 2 … 6

  /// Largest time between control points; shortened so that a whole number fits between the first and the last stamp.
  /// 0 chooses: for poses at most 15 ms apart (in the median) 20 ms, but at least two and at most four median
  /// intervals, which averages noise; for sparser poses, and where the body would turn by more than 60° from one
  /// control point to the next, half the median interval, halved until it turns by less than 22.5°, which passes
  /// through the poses. Beware of splines of odd order with as many knots as poses: uniform poses hardly see them
  /// oscillate from knot to knot.
  double knot_interval_s = 0.0;

  /// Time constant τ of the regularisation: motion of angular frequency ω is attenuated by about 1/(1 + (τω)⁶).
  /// It does not depend on the knot interval or the rate of the poses, except that 0 chooses: a fifth of the knot
  /// interval, to keep noise from the outermost control points, which the poses hardly see; a twentieth where the knots
  /// are closer than the poses, just enough to determine every control point.
  double smoothing_time_s = 0.0;
};

/// How far the fitted spline stays from the poses, and what was chosen.
struct FitReport {
  double rms_position_m = 0.0, max_position_m = 0.0;
  double rms_rotation_rad = 0.0, max_rotation_rad = 0.0;
  double knot_interval_s = 0.0;
  double smoothing_time_s = 0.0;
  int control_points = 0;
};

struct FittedTrajectory {
  SplineTrajectory trajectory;
  FitReport report;
};

/// The spline from the first to the last stamp that minimises, for the positions p and the rotations R separately,
///   Σ_i |p_i − p(t_i)|² + (τ⁶/Δt) ∫ |p‴|² dt   and   Σ_i |Log(R(t_i)⁻¹ R_i)|² + (τ⁶/Δt) ∫ |ω″|² dt,
/// with Δt the median interval of the poses and the integrals taken from differences of control points: with knot
/// interval h, ∫|p‴|² ≈ Σ_j |third difference of p_j|² h⁻⁵, and ∫|ω″|² ≈ Σ_j |second difference of d_j|² h⁻⁵ with
/// d_j = Log(R_j⁻¹ R_{j+1}). With only two poses the second derivative is penalised instead of the third (and τ⁴ h⁻³
/// stands for τ⁶ h⁻⁵). Positions need one linear solve; rotations take Gauss-Newton steps with exact Jacobians
/// until the steps vanish.
///
/// Between successive poses the body is taken to turn the shorter way. Stamps need not be uniform, within the limit
/// of find_stamp_fault(). Throws UserError for fewer than two poses, faulty stamps, poses that are not finite, a span
/// of less than a millisecond, options out of range, knots so far apart that the body turns by nearly 180° from one to
/// the next, control points that nothing determines, and rotations without a smooth fit.
FittedTrajectory fit_trajectory(std::span<const TimedPose> poses, const FitOptions& options);

}  // namespace esim
