#include "esim/motion/waypoints/waypoint_path.h"

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <algorithm>
#include <optional>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"

namespace esim::inline motion {

namespace {

using Rate = Eigen::Matrix<double, 6, 1>;  // velocity and angular velocity in the world frame

constexpr double kLargestRateInMeans = 2.0;

/// The mean rates of position and rotation on a leg.
Rate mean_rate(const WaypointCourse& course, std::size_t leg) {
  Rate rate;
  rate.head<3>() = course.displacement(leg) / course.leg_s[leg];
  rate.tail<3>() = course.turn(leg) / course.leg_s[leg];
  return rate;
}

/// The previous and the next leg, if the path is smooth at the joint.
std::optional<std::size_t> joined_before(const WaypointCourse& course, std::size_t leg) {
  if (course.stops[leg] || (leg == 0 && !course.periodic)) return std::nullopt;
  return leg == 0 ? course.legs() - 1 : leg - 1;
}
std::optional<std::size_t> joined_after(const WaypointCourse& course, std::size_t leg) {
  if (leg + 1 < course.legs()) return course.stops[leg + 1] ? std::nullopt : std::optional(leg + 1);
  return course.periodic ? std::optional(std::size_t{0}) : std::nullopt;
}

/// Velocities and accelerations at the two ends of a leg, in the world frame.
struct LegEnds {
  Rate rate[2], acceleration[2];
};

/// Rate and acceleration at an end of a leg without a joint there, from those at its other end.
void free_end(const Rate& mean, LegEnds& leg, int end, int part) {
  leg.rate[end].segment<3>(part) = 1.5 * mean.segment<3>(part) - 0.5 * leg.rate[1 - end].segment<3>(part);
  leg.acceleration[end].segment<3>(part).setZero();
}

/// The interpolating cubic spline: on a leg of duration h and mean rate d with rates v and w at its ends, the
/// acceleration is 6 d/h − (4 v + 2 w)/h at its start and −6 d/h + (2 v + 4 w)/h at its end. Rates and accelerations
/// are continuous where legs are joined; accelerations vanish elsewhere.
std::vector<LegEnds> spline_ends(const WaypointCourse& course) {
  const auto legs = static_cast<Eigen::Index>(course.legs());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Matrix<double, Eigen::Dynamic, 6> right = Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(2 * legs, 6);
  std::vector<Rate> mean;
  for (std::size_t i = 0; i < course.legs(); ++i) mean.push_back(mean_rate(course, i));

  for (std::size_t i = 0; i < course.legs(); ++i) {
    const int start = static_cast<int>(2 * i), end = start + 1;  // unknowns; each end of a leg has an equation
    const double h = course.leg_s[i];
    entries.emplace_back(start, start, 4.0);
    entries.emplace_back(start, end, 2.0);
    right.row(start) = 6.0 * mean[i].transpose();
    if (const auto before = joined_before(course, i)) {
      const int k = static_cast<int>(2 * *before);
      const double ratio = h / course.leg_s[*before];
      entries.emplace_back(start, k, 2.0 * ratio);
      entries.emplace_back(start, k + 1, 4.0 * ratio);
      right.row(start) += 6.0 * ratio * mean[*before].transpose();
    }
    if (const auto after = joined_after(course, i)) {
      entries.emplace_back(end, end, 1.0);
      entries.emplace_back(end, static_cast<int>(2 * *after), -1.0);
    } else {
      entries.emplace_back(end, start, 2.0);
      entries.emplace_back(end, end, 4.0);
      right.row(end) = 6.0 * mean[i].transpose();
    }
  }
  Eigen::SparseMatrix<double> matrix(2 * legs, 2 * legs);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success) throw InternalError("waypoints: the spline's equations have no solution");
  const Eigen::Matrix<double, Eigen::Dynamic, 6> rates = factor.solve(right);

  std::vector<LegEnds> ends(course.legs());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Rate v = rates.row(static_cast<Eigen::Index>(2 * i)), w = rates.row(static_cast<Eigen::Index>(2 * i + 1));
    const double h = course.leg_s[i];
    ends[i].rate[0] = v;
    ends[i].rate[1] = w;
    ends[i].acceleration[0] = (6.0 * mean[i] - 4.0 * v - 2.0 * w) / h;
    ends[i].acceleration[1] = (-6.0 * mean[i] + 2.0 * v + 4.0 * w) / h;
  }

  // At a joint of two legs, the rates of positions and of rotations are limited by the slower leg. Both legs get the
  // same values. If a leg is joined at one end only, the values at its other end follow from these.
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto before = joined_before(course, i);
    if (!before) continue;
    for (const int part : {0, 3}) {
      auto rate = ends[i].rate[0].segment<3>(part);
      const double largest =
          kLargestRateInMeans * std::min(mean[i].segment<3>(part).norm(), mean[*before].segment<3>(part).norm());
      const double norm = rate.norm();
      if (norm < largest) continue;
      rate *= norm > 0.0 ? largest / norm : 0.0;
      ends[i].acceleration[0].segment<3>(part).setZero();
      if (!joined_after(course, i)) free_end(mean[i], ends[i], 1, part);
      if (!joined_before(course, *before)) {
        ends[*before].rate[1].segment<3>(part) = rate;
        free_end(mean[*before], ends[*before], 0, part);
      }
    }
    ends[*before].rate[1] = ends[i].rate[0];
    ends[*before].acceleration[1] = ends[i].acceleration[0];
  }
  return ends;
}

SplineValue state(const SE3& pose, const Rate& rate, const Rate& acceleration) {
  const Eigen::Quaterniond to_body = pose.rotation.conjugate();
  return {pose, rate.head<3>(), acceleration.head<3>(), to_body * rate.tail<3>(), to_body * acceleration.tail<3>()};
}

}  // namespace

Eigen::Vector3d WaypointCourse::displacement(std::size_t leg) const {
  return nodes[leg + 1].translation - nodes[leg].translation;
}

Eigen::Vector3d WaypointCourse::turn(std::size_t leg) const {
  const Eigen::Quaterniond& from = nodes[leg].rotation;
  return from * so3_log((from.conjugate() * nodes[leg + 1].rotation).normalized());
}

std::vector<QuinticBezier> smooth_path(const WaypointCourse& course) {
  const std::vector<LegEnds> ends = spline_ends(course);
  std::vector<QuinticBezier> path;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    path.emplace_back(state(course.nodes[i], ends[i].rate[0], ends[i].acceleration[0]),
                      state(course.nodes[i + 1], ends[i].rate[1], ends[i].acceleration[1]), course.leg_s[i]);
  }
  return path;
}

}  // namespace esim::inline motion
