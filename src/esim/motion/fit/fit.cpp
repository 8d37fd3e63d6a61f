#include "esim/motion/fit/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "esim/motion/fit/fit_controls.h"

namespace esim::inline motion {

namespace {

constexpr TimeNs kShortestSpan = kNsPerMs;
constexpr double kDenseSmoothingPerKnot = 0.2;
constexpr double kSparseSmoothingPerKnot = 0.05;

// Poses with at most this interval are averaged by wider knot intervals; the spline passes through sparser poses.
constexpr double kLongestDenseInterval_s = 0.015;
constexpr double kDenseKnotInterval_s = 0.02;
constexpr double kMaxDenseTurn_rad = std::numbers::pi / 3.0;
constexpr double kMaxSparseTurn_rad = std::numbers::pi / 8.0;
constexpr double kLargestTurn_rad = 0.9 * std::numbers::pi;

/// The poses as plain columns, with times in seconds since the first.
struct PoseColumns {
  std::vector<double> times_s;
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<double> turned_rad;  // per pose: sum of the angles from pose to pose so far
};

void validate(std::span<const TimedPose> poses, const FitOptions& options) {
  if (poses.size() < 2) throw UserError(fmt::format("trajectory fit: {} poses; give at least two", poses.size()));
  if (options.order < kMinSplineOrder || options.order > kMaxSplineOrder) {
    throw UserError(fmt::format("trajectory fit: order is {}; it must be in {} .. {}", options.order, kMinSplineOrder,
                                kMaxSplineOrder));
  }
  for (const auto& [name, value] : {std::pair{"knot_interval_s", options.knot_interval_s},
                                    std::pair{"smoothing_time_s", options.smoothing_time_s}}) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      throw UserError(
          fmt::format("trajectory fit: {} is {}; it must be positive, or 0 for an automatic choice", name, value));
    }
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const SE3& pose = poses[i].T_world_body;
    const double norm = pose.rotation.norm();
    if (!pose.translation.allFinite() || !(std::abs(norm - 1.0) < 1e-3)) {
      throw UserError(
          fmt::format("trajectory fit: pose {} is not finite, or its quaternion does not have unit norm", i));
    }
  }
  if (const auto fault = find_stamp_fault(poses)) {
    throw UserError(fmt::format("trajectory fit: pose {}: {}", fault->pose, fault->message));
  }
  if (const TimeNs span = poses.back().t - poses.front().t; span < kShortestSpan) {
    throw UserError(fmt::format("trajectory fit: the poses span only {} ns; check the unit of the stamps", span));
  }
}

PoseColumns columns(std::span<const TimedPose> poses) {
  PoseColumns result;
  double turned_rad = 0.0;
  for (const TimedPose& pose : poses) {
    const Eigen::Quaterniond rotation = pose.T_world_body.rotation.normalized();
    if (!result.rotations.empty()) turned_rad += so3_log(result.rotations.back().conjugate() * rotation).norm();
    result.times_s.push_back(to_seconds(pose.t - poses.front().t));
    result.positions.push_back(pose.T_world_body.translation);
    result.rotations.push_back(rotation);
    result.turned_rad.push_back(turned_rad);
  }
  return result;
}

struct Interpolated {
  Eigen::Quaterniond rotation;
  double turned_rad;
};

/// Between two poses the body rotates at a constant rate; before the first and after the last pose it rests.
Interpolated interpolate(const PoseColumns& poses, double t_s) {
  const double t = std::clamp(t_s, poses.times_s.front(), poses.times_s.back());
  const auto after = std::upper_bound(poses.times_s.begin() + 1, poses.times_s.end() - 1, t);
  const auto i = static_cast<std::size_t>(after - poses.times_s.begin());
  const double fraction = (t - poses.times_s[i - 1]) / (poses.times_s[i] - poses.times_s[i - 1]);
  const Eigen::Vector3d turn = so3_log(poses.rotations[i - 1].conjugate() * poses.rotations[i]);
  return {poses.rotations[i - 1] * so3_exp(fraction * turn),
          std::lerp(poses.turned_rad[i - 1], poses.turned_rad[i], fraction)};
}

UniformBasis basis_of(const PoseColumns& poses, int order, int segments) {
  return UniformBasis(order, 0.0, poses.times_s.back() / segments, segments + order - 1);
}

/// The largest rotation of the body from the centre of one control point to that of the next, along the poses, and its
/// time.
struct FastestTurn {
  double angle_rad = 0.0;
  double t_s = 0.0;
};
FastestTurn fastest_turn(const PoseColumns& poses, const UniformBasis& basis) {
  FastestTurn fastest;
  double before = interpolate(poses, basis.centre_s(0)).turned_rad;
  for (int j = 1; j < basis.control_points(); ++j) {
    const double turned = interpolate(poses, basis.centre_s(j)).turned_rad;
    if (turned - before > fastest.angle_rad) fastest = {turned - before, basis.centre_s(j)};
    before = turned;
  }
  return fastest;
}

double whole_segments(const PoseColumns& poses, double knot_interval_s) {
  return std::max(1.0, std::ceil(poses.times_s.back() / knot_interval_s - 1e-6));
}

double max_segments(const PoseColumns& poses) { return 64.0 * static_cast<double>(poses.times_s.size()); }

std::string describe(const FastestTurn& turn) {
  return fmt::format("the body turns by {:.0f} degrees between two knots near {:.6f} s after the first pose",
                     turn.angle_rad * 180.0 / std::numbers::pi, turn.t_s);
}

UniformBasis basis_with_knot_interval(const PoseColumns& poses, int order, double knot_interval_s) {
  const double segments = whole_segments(poses, knot_interval_s);
  if (segments > max_segments(poses)) {
    throw UserError(fmt::format(
        "trajectory fit: a knot interval of {} s is too short for {} poses in {} s; choose more than {:.3g} s",
        knot_interval_s, poses.times_s.size(), poses.times_s.back(), poses.times_s.back() / max_segments(poses)));
  }
  const UniformBasis basis = basis_of(poses, order, static_cast<int>(segments));
  if (const FastestTurn turn = fastest_turn(poses, basis); turn.angle_rad > kLargestTurn_rad) {
    throw UserError(fmt::format("trajectory fit: {}; choose a shorter knot interval", describe(turn)));
  }
  return basis;
}

UniformBasis chosen_basis(const PoseColumns& poses, int order, double median_interval_s) {
  if (median_interval_s <= kLongestDenseInterval_s) {
    const double interval_s = std::clamp(kDenseKnotInterval_s, 2.0 * median_interval_s, 4.0 * median_interval_s);
    const UniformBasis basis = basis_of(poses, order, static_cast<int>(whole_segments(poses, interval_s)));
    if (fastest_turn(poses, basis).angle_rad <= kMaxDenseTurn_rad) return basis;
  }
  // Knots at twice the rate of the poses: at the same rate, poses hardly constrain an oscillation of a spline of odd
  // order from knot to knot.
  FastestTurn turn;
  for (double segments = whole_segments(poses, 0.5 * median_interval_s); segments <= max_segments(poses);
       segments *= 2.0) {
    const UniformBasis basis = basis_of(poses, order, static_cast<int>(segments));
    turn = fastest_turn(poses, basis);
    if (turn.angle_rad <= kMaxSparseTurn_rad) return basis;
  }
  throw UserError(fmt::format("trajectory fit: {}; check the poses for jumps, or give more", describe(turn)));
}

FitReport residuals(const PoseColumns& poses, const Se3Spline& spline) {
  FitReport report;
  double position_sum = 0.0, rotation_sum = 0.0;
  for (std::size_t i = 0; i < poses.times_s.size(); ++i) {
    const SE3 pose = spline.at(poses.times_s[i]).pose;
    const double position_m = (pose.translation - poses.positions[i]).norm();
    const double rotation_rad = so3_log(pose.rotation.conjugate() * poses.rotations[i]).norm();
    position_sum += position_m * position_m;
    rotation_sum += rotation_rad * rotation_rad;
    report.max_position_m = std::max(report.max_position_m, position_m);
    report.max_rotation_rad = std::max(report.max_rotation_rad, rotation_rad);
  }
  const auto count = static_cast<double>(poses.times_s.size());
  report.rms_position_m = std::sqrt(position_sum / count);
  report.rms_rotation_rad = std::sqrt(rotation_sum / count);
  return report;
}

}  // namespace

FittedTrajectory fit_trajectory(std::span<const TimedPose> poses, const FitOptions& options) {
  validate(poses, options);
  const PoseColumns data = columns(poses);
  const double median_interval_s = to_seconds(median_interval(poses));
  const UniformBasis basis = options.knot_interval_s > 0.0
                                 ? basis_with_knot_interval(data, options.order, options.knot_interval_s)
                                 : chosen_basis(data, options.order, median_interval_s);

  const double knot_interval_s = basis.knot_interval_s();
  const double chosen_smoothing_time_s =
      knot_interval_s * (knot_interval_s > median_interval_s ? kDenseSmoothingPerKnot : kSparseSmoothingPerKnot);
  const double smoothing_time_s = options.smoothing_time_s > 0.0 ? options.smoothing_time_s : chosen_smoothing_time_s;
  SmoothnessPenalty penalty;  // its order leaves only polynomials unpenalised that the poses determine
  penalty.difference_order = poses.size() < 3 ? 2 : 3;
  penalty.weight =
      std::pow(smoothing_time_s / knot_interval_s, 2 * penalty.difference_order) * knot_interval_s / median_interval_s;

  std::vector<Eigen::Vector3d> positions = fit_control_positions(basis, data.times_s, data.positions, penalty);
  std::vector<Eigen::Quaterniond> initial;
  for (int j = 0; j < basis.control_points(); ++j) initial.push_back(interpolate(data, basis.centre_s(j)).rotation);
  std::vector<Eigen::Quaterniond> rotations =
      fit_control_rotations(basis, data.times_s, data.rotations, penalty, std::move(initial));

  Se3Spline spline(options.order, 0.0, knot_interval_s, std::move(rotations), std::move(positions));
  FitReport report = residuals(data, spline);
  report.knot_interval_s = knot_interval_s;
  report.smoothing_time_s = smoothing_time_s;
  report.control_points = basis.control_points();
  return {SplineTrajectory(std::move(spline), poses.front().t, poses.back().t), report};
}

}  // namespace esim::inline motion
