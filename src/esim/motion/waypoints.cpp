#include "esim/motion/waypoints.h"

#include <fmt/format.h>

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>
#include <string>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"

namespace esim {

namespace {

using Rate = Eigen::Matrix<double, 6, 1>;  // velocity and angular velocity in the world frame

constexpr double kSamePlace_m = 1e-6;
constexpr double kSameRotation_rad = 1e-9;
constexpr double kShortestLeg_s = 1e-6;
constexpr double kMostTime_s = 1e8;
constexpr double kLargestRateInMeans = 2.0;  // more would lead past the point and back
constexpr double kLargestRampOfLeg = 1.0 / 3.0;

[[noreturn]] void fail(std::size_t point, const std::string& message) {
  throw UserError(fmt::format("points.{}: {}", point, message));
}

void validate(const WaypointOptions& options) {
  const auto require_positive = [](const char* name, double value) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw UserError(fmt::format("{} is {}; it must be positive and finite", name, value));
  };
  require_positive("speed", options.speed_m_per_s);
  require_positive("the rate of turning", options.turn_rad_per_s);
  require_positive("ramp_s", options.ramp_s);
}

void validate(std::span<const Waypoint> points, const WaypointOptions& options) {
  if (points.size() < 2) {
    throw UserError(fmt::format("points: {} point{}, but a motion needs at least two; add points", points.size(),
                                points.size() == 1 ? "" : "s"));
  }
  const bool timed = points[0].t_s.has_value();
  if (timed && options.closed)
    throw UserError("closed: the way back has no time; use speeds, or repeat the first point with a time at the end");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Waypoint& point = points[i];
    const SE3& pose = point.T_world_body;
    if (!pose.translation.allFinite() || !(std::abs(pose.rotation.norm() - 1.0) < 1e-3))
      fail(i, "is not finite, or its quaternion has not unit norm; correct it");
    if (!(point.pause_s >= 0.0 && point.pause_s <= kMostTime_s))
      fail(i, fmt::format("pause_s: {} is out of range; it must be 0 to {:g} s", point.pause_s, kMostTime_s));
    if (point.t_s.has_value() != timed) {
      fail(i, timed ? "has no t, but points.0 has; give a time to every point or to none"
                    : "has t, but points.0 has none; give a time to every point or to none");
    }
    if (timed && point.speed_m_per_s)
      fail(i, "has both t and speed; the times say how fast the motion is: remove one of the two");
    if (point.speed_m_per_s && (!(*point.speed_m_per_s > 0.0) || !std::isfinite(*point.speed_m_per_s)))
      fail(i, fmt::format("speed: {} must be positive and finite", *point.speed_m_per_s));
    if (timed && !(std::abs(*point.t_s) <= kMostTime_s))
      fail(i, fmt::format("t: {} is out of range; it must be within {:g} s", *point.t_s, kMostTime_s));
    if (!timed || i == 0) continue;
    const double before = *points[i - 1].t_s;
    if (to_ns(*point.t_s) == to_ns(before))
      fail(i,
           fmt::format("t: {} s is the time of the point before as well; give each point a time of its own", before));
    if (*point.t_s < before)
      fail(i, fmt::format("t: {} s comes before the {} s of the point before; sort the points by time", *point.t_s,
                          before));
    if (to_ns(before + points[i - 1].pause_s) >= to_ns(*point.t_s)) {
      fail(i - 1, fmt::format("pause_s: {} s last until after the next point's time; make the pause shorter than {} s",
                              points[i - 1].pause_s, *point.t_s - before));
    }
  }
}

/// What the path is made of: the poses that it joins, and where the body stops.
struct Course {
  std::vector<SE3> nodes;   // the points; of a closed motion the first one again
  std::vector<bool> stops;  // one per node
  bool periodic = false;    // goes on smoothly from the last node to the first
  std::vector<double> leg_s;

  std::size_t legs() const { return nodes.size() - 1; }

  Eigen::Vector3d displacement(std::size_t leg) const { return nodes[leg + 1].translation - nodes[leg].translation; }

  /// In the world frame.
  Eigen::Vector3d turn(std::size_t leg) const {
    const Eigen::Quaterniond& from = nodes[leg].rotation;
    return from * so3_log((from.conjugate() * nodes[leg + 1].rotation).normalized());
  }

  bool on_the_spot(std::size_t leg) const { return displacement(leg).norm() < kSamePlace_m; }

  Rate mean_rate(std::size_t leg) const {
    Rate rate;
    rate.head<3>() = displacement(leg) / leg_s[leg];
    rate.tail<3>() = turn(leg) / leg_s[leg];
    return rate;
  }

  /// The leg that one goes on from smoothly, if any.
  std::optional<std::size_t> joined_before(std::size_t leg) const {
    if (stops[leg] || (leg == 0 && !periodic)) return std::nullopt;
    return leg == 0 ? legs() - 1 : leg - 1;
  }
  std::optional<std::size_t> joined_after(std::size_t leg) const {
    if (leg + 1 < legs()) return stops[leg + 1] ? std::nullopt : std::optional(leg + 1);
    return periodic ? std::optional(std::size_t{0}) : std::nullopt;
  }
};

Course course_of(std::span<const Waypoint> points, const WaypointOptions& options) {
  Course course;
  for (const Waypoint& point : points) {
    course.nodes.push_back({point.T_world_body.rotation.normalized(), point.T_world_body.translation});
    course.stops.push_back(point.pause_s > 0.0);
  }
  if (options.closed) {
    course.nodes.push_back(course.nodes.front());
    course.stops.push_back(course.stops.front());
  }
  if (options.rest) course.stops.front() = course.stops.back() = true;
  for (std::size_t i = 0; i < course.legs(); ++i) {
    if (course.on_the_spot(i)) course.stops[i] = course.stops[i + 1] = true;
  }
  if (options.closed) {
    const bool stop = course.stops.front() || course.stops.back();
    course.stops.front() = course.stops.back() = stop;
    course.periodic = !stop;
  }
  return course;
}

/// Velocities and accelerations at the two ends of a leg, in the world frame.
struct LegEnds {
  Rate rate[2], acceleration[2];
};

/// Rate and acceleration at the end of a leg that is not joined there, by those of its other end.
void free_end(const Rate& mean, LegEnds& leg, int end, int part) {
  leg.rate[end].segment<3>(part) = 1.5 * mean.segment<3>(part) - 0.5 * leg.rate[1 - end].segment<3>(part);
  leg.acceleration[end].segment<3>(part).setZero();
}

/// The interpolating cubic spline: on a leg of duration h and mean rate d with rates v and w at its ends, the
/// acceleration is 6 d/h − (4 v + 2 w)/h at its start and −6 d/h + (2 v + 4 w)/h at its end. Rates and accelerations
/// are continuous where legs are joined; accelerations vanish elsewhere.
std::vector<LegEnds> spline_ends(const Course& course) {
  const auto legs = static_cast<Eigen::Index>(course.legs());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Matrix<double, Eigen::Dynamic, 6> right = Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(2 * legs, 6);
  std::vector<Rate> mean;
  for (std::size_t i = 0; i < course.legs(); ++i) mean.push_back(course.mean_rate(i));

  for (std::size_t i = 0; i < course.legs(); ++i) {
    const int start = static_cast<int>(2 * i), end = start + 1;  // unknowns; each end of a leg has an equation
    const double h = course.leg_s[i];
    entries.emplace_back(start, start, 4.0);
    entries.emplace_back(start, end, 2.0);
    right.row(start) = 6.0 * mean[i].transpose();
    if (const auto before = course.joined_before(i)) {
      const int k = static_cast<int>(2 * *before);
      const double ratio = h / course.leg_s[*before];
      entries.emplace_back(start, k, 2.0 * ratio);
      entries.emplace_back(start, k + 1, 4.0 * ratio);
      right.row(start) += 6.0 * ratio * mean[*before].transpose();
    }
    if (const auto after = course.joined_after(i)) {
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

  // Where two legs are joined: no more than the slower one stands, of positions and of rotations. Both get the very
  // same values. What a leg has that is joined at one end only follows from there.
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto before = course.joined_before(i);
    if (!before) continue;
    for (const int part : {0, 3}) {
      auto rate = ends[i].rate[0].segment<3>(part);
      const double largest =
          kLargestRateInMeans * std::min(mean[i].segment<3>(part).norm(), mean[*before].segment<3>(part).norm());
      const double norm = rate.norm();
      if (norm < largest) continue;
      rate *= norm > 0.0 ? largest / norm : 0.0;
      ends[i].acceleration[0].segment<3>(part).setZero();
      if (!course.joined_after(i)) free_end(mean[i], ends[i], 1, part);
      if (!course.joined_before(*before)) {
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

std::vector<QuinticBezier> path_of(const Course& course) {
  const std::vector<LegEnds> ends = spline_ends(course);
  std::vector<QuinticBezier> path;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    path.emplace_back(state(course.nodes[i], ends[i].rate[0], ends[i].acceleration[0]),
                      state(course.nodes[i + 1], ends[i].rate[1], ends[i].acceleration[1]), course.leg_s[i]);
  }
  return path;
}

/// Length and angle along a curve.
struct Extent {
  double length_m = 0.0, angle_rad = 0.0;
};
Extent extent_of(const QuinticBezier& curve) {
  constexpr int kParts = 32;
  Extent extent;
  for (int i = 0; i < kParts; ++i) {
    const SplineValue middle = curve.at((i + 0.5) / kParts * curve.duration_s());
    extent.length_m += middle.velocity.norm() / kParts * curve.duration_s();
    extent.angle_rad += middle.angular_velocity.norm() / kParts * curve.duration_s();
  }
  return extent;
}

/// How long each leg takes without standing still at its ends: first along its chord, then along the curve that this
/// makes.
void set_leg_times_by_speed(std::span<const Waypoint> points, const WaypointOptions& options, Course& course) {
  constexpr int kRounds = 6;
  const auto time_of = [&](std::size_t leg, const Extent& extent) {
    return std::max(extent.length_m / points[leg].speed_m_per_s.value_or(options.speed_m_per_s),
                    extent.angle_rad / options.turn_rad_per_s);
  };
  double whole_s = 0.0;
  for (std::size_t i = 0; i < course.legs(); ++i) {
    const Extent chord{course.displacement(i).norm(), course.turn(i).norm()};
    if (chord.length_m < kSamePlace_m && chord.angle_rad < kSameRotation_rad) {
      if (i + 1 == points.size())
        throw UserError("closed: the last point is the first one again; remove the last point");
      fail(i + 1, "is the pose of the point before; remove it, or wait there with pause_s");
    }
    course.leg_s.push_back(time_of(i, chord));
    if (course.leg_s.back() < kShortestLeg_s)
      fail(i + 1, "follows within less than a microsecond; remove it, or lower the speed");
    whole_s += course.leg_s.back() + points[i].pause_s;
    if (!(whole_s <= kMostTime_s))
      fail(i, fmt::format("is left so slowly that the motion takes more than {:g} s; raise speed", kMostTime_s));
  }
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<QuinticBezier> path = path_of(course);
    for (std::size_t i = 0; i < path.size(); ++i) course.leg_s[i] = time_of(i, extent_of(path[i]));
  }
}

/// The path's parameter at a time, and its derivatives.
struct Clock {
  double tau_s, rate, rate_per_s;
};

/// τ of a ramp that begins at rest: ∫ (3 x² − 2 x³) dt.
Clock ramp(double t_s, double ramp_s) {
  const double x = t_s / ramp_s;
  return {ramp_s * x * x * x * (1.0 - 0.5 * x), x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / ramp_s};
}

/// On a leg that lasts `leg_s`, its ramps included.
Clock clock(double t_s, double leg_s, double ramp_in_s, double ramp_out_s) {
  if (t_s < ramp_in_s) return ramp(t_s, ramp_in_s);
  if (const double left_s = leg_s - t_s; left_s < ramp_out_s) {
    const Clock backwards = ramp(left_s, ramp_out_s);
    return {leg_s - 0.5 * (ramp_in_s + ramp_out_s) - backwards.tau_s, backwards.rate, -backwards.rate_per_s};
  }
  return {t_s - 0.5 * ramp_in_s, 1.0, 0.0};
}

}  // namespace

WaypointTrajectory::WaypointTrajectory(std::span<const Waypoint> points, const WaypointOptions& options) {
  validate(options);
  validate(points, options);
  Course course = course_of(points, options);
  const bool timed = points[0].t_s.has_value();
  if (!timed) set_leg_times_by_speed(points, options, course);

  struct Schedule {
    TimeNs leave, arrive;
    double ramp_in_s, ramp_out_s;
  };
  std::vector<Schedule> schedule;
  start_ = timed ? to_ns(*points[0].t_s) : 0;
  TimeNs arrived = start_;
  course.leg_s.resize(course.legs());
  for (std::size_t i = 0; i < course.legs(); ++i) {
    Schedule leg{};
    leg.leave = arrived + to_ns(points[i].pause_s);
    const double ramp_s =
        timed ? std::min(options.ramp_s, kLargestRampOfLeg * (*points[i + 1].t_s - to_seconds(leg.leave)))
              : std::min(options.ramp_s, course.leg_s[i]);
    leg.ramp_in_s = course.stops[i] ? ramp_s : 0.0;
    leg.ramp_out_s = course.stops[i + 1] ? ramp_s : 0.0;
    const double ramps_s = 0.5 * (leg.ramp_in_s + leg.ramp_out_s);
    leg.arrive = timed ? to_ns(*points[i + 1].t_s) : leg.leave + std::max<TimeNs>(1, to_ns(course.leg_s[i] + ramps_s));
    course.leg_s[i] = to_seconds(leg.arrive - leg.leave) - ramps_s;
    schedule.push_back(leg);
    arrived = leg.arrive;
  }
  // A closed motion has stood at its first point already.
  end_ = arrived + (options.closed ? 0 : to_ns(points.back().pause_s));

  const std::vector<QuinticBezier> path = path_of(course);
  for (std::size_t i = 0; i < path.size(); ++i) {
    legs_.push_back({schedule[i].leave, schedule[i].arrive, schedule[i].ramp_in_s, schedule[i].ramp_out_s, path[i]});
  }
}

Kinematics WaypointTrajectory::at(TimeNs t) const {
  require_covered(t);
  // The first leg that has not ended: before it begins, the body stands at its start.
  auto leg = std::lower_bound(legs_.begin(), legs_.end(), t, [](const Leg& l, TimeNs time) { return l.arrive < time; });
  if (leg == legs_.end()) leg = legs_.end() - 1;  // a pause at the last point
  const double leg_s = to_seconds(leg->arrive - leg->leave);
  const double t_s = std::clamp(to_seconds(t - leg->leave), 0.0, leg_s);
  const Clock now = clock(t_s, leg_s, leg->ramp_in_s, leg->ramp_out_s);
  const SplineValue value = leg->path.at(std::clamp(now.tau_s, 0.0, leg->path.duration_s()));
  const double squared = now.rate * now.rate;
  return {value.pose, now.rate * value.velocity, squared * value.acceleration + now.rate_per_s * value.velocity,
          now.rate * value.angular_velocity,
          squared * value.angular_acceleration + now.rate_per_s * value.angular_velocity};
}

std::vector<TimeNs> WaypointTrajectory::arrivals() const {
  std::vector<TimeNs> times{start_};
  for (const Leg& leg : legs_) times.push_back(leg.arrive);
  return times;
}

}  // namespace esim
