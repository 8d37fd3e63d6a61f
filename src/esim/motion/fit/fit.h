#pragma once

#include <span>

#include "esim/motion/spline.h"
#include "esim/motion/timed_pose.h"

namespace esim::inline motion {

struct FitOptions {
  int order = 5;  // of the spline, 2 … 6

  /// Maximum time between control points; reduced so that an integer number fits between the first and last stamp.
  /// 0 chooses it automatically. For poses with a median interval of at most 15 ms it is 20 ms, but at least two and at
  /// most four median intervals, which averages noise. For sparser poses, or if the body would rotate by more than 60°
  /// from one control point to the next, it is half the median interval, halved until the rotation is below 22.5°; the
  /// spline then passes through the poses. Do not use an odd order with as many knots as poses: uniform poses hardly
  /// constrain oscillations from knot to knot.
  double knot_interval_s = 0.0;

  /// Time constant τ of the regularisation: motion of angular frequency ω is attenuated by about 1/(1 + (τω)⁶).
  /// The attenuation does not depend on the knot interval or the rate of the poses. 0 chooses it automatically: a fifth
  /// of the knot interval, which keeps noise from the outermost control points, since the poses hardly constrain them;
  /// or a twentieth if the knots are closer than the poses, which is enough to determine every control point.
  double smoothing_time_s = 0.0;
};

/// The distance of the fitted spline from the poses, and the options that were chosen.
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
/// replaces τ⁶ h⁻⁵). Positions require one linear problem, solved to rounding errors; rotations require Gauss-Newton
/// steps with exact Jacobians until convergence.
///
/// Between successive poses, the shorter of the two rotations is assumed. Stamps need not be uniform, within the limit
/// of find_stamp_fault(). Throws UserError for fewer than two poses, faulty stamps, poses that are not finite, a span
/// of less than a millisecond, options out of range, knots so far apart that the body rotates by nearly 180° from one
/// to the next, undetermined control points, and rotations without a smooth fit.
FittedTrajectory fit_trajectory(std::span<const TimedPose> poses, const FitOptions& options);

}  // namespace esim::inline motion
