#include "esim/motion/waypoints/waypoints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "esim/core/error.h"
#include "esim/motion/waypoints/waypoint_path.h"

namespace esim::inline motion {

namespace {

constexpr double kSamePlace_m = 1e-6;
constexpr double kSameRotation_rad = 1e-9;
constexpr double kShortestLeg_s = 1e-6;
constexpr double kMaxTime_s = 1e8;
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
  require_positive("the turn rate", options.turn_rad_per_s);
  require_positive("ramp_s", options.ramp_s);
}

void validate(std::span<const Waypoint> points, const WaypointOptions& options) {
  if (points.size() < 2) {
    throw UserError(fmt::format("points: {} point{}, but a motion needs at least two; add points", points.size(),
                                points.size() == 1 ? "" : "s"));
  }
  const bool timed = points[0].t_s.has_value();
  if (timed && options.closed)
    throw UserError(
        "closed: the segment back to the first point has no time; use speeds, or repeat the first point with a time at "
        "the end");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Waypoint& point = points[i];
    const SE3& pose = point.T_world_body;
    if (!pose.translation.allFinite() || !(std::abs(pose.rotation.norm() - 1.0) < 1e-3))
      fail(i, "is not finite, or its quaternion does not have unit norm; correct it");
    if (!(point.pause_s >= 0.0 && point.pause_s <= kMaxTime_s))
      fail(i, fmt::format("pause_s: {} is out of range; it must be 0 to {:g} s", point.pause_s, kMaxTime_s));
    if (point.t_s.has_value() != timed) {
      fail(i, timed ? "has no t, but points.0 has; give a time to every point or to none"
                    : "has t, but points.0 has none; give a time to every point or to none");
    }
    if (timed && point.speed_m_per_s)
      fail(i, "has both t and speed, but times already define the speed; remove one of the two");
    if (point.speed_m_per_s && (!(*point.speed_m_per_s > 0.0) || !std::isfinite(*point.speed_m_per_s)))
      fail(i, fmt::format("speed: {} must be positive and finite", *point.speed_m_per_s));
    if (timed && !(std::abs(*point.t_s) <= kMaxTime_s))
      fail(i, fmt::format("t: {} is out of range; it must be within {:g} s", *point.t_s, kMaxTime_s));
    if (!timed || i == 0) continue;
    const double before = *points[i - 1].t_s;
    if (to_ns(*point.t_s) == to_ns(before))
      fail(i, fmt::format("t: {} s is also the time of the previous point; give each point a different time", before));
    if (*point.t_s < before)
      fail(i, fmt::format("t: {} s is before the {} s of the previous point; sort the points by time", *point.t_s,
                          before));
    if (to_ns(before + points[i - 1].pause_s) >= to_ns(*point.t_s)) {
      fail(i - 1, fmt::format("pause_s: a pause of {} s ends after the next point's time; make it shorter than {} s",
                              points[i - 1].pause_s, *point.t_s - before));
    }
  }
}

WaypointCourse course_of(std::span<const Waypoint> points, const WaypointOptions& options) {
  WaypointCourse course;
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
    if (course.displacement(i).norm() < kSamePlace_m) course.stops[i] = course.stops[i + 1] = true;
  }
  if (options.closed) {
    const bool stop = course.stops.front() || course.stops.back();
    course.stops.front() = course.stops.back() = stop;
    course.periodic = !stop;
  }
  return course;
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

/// Sets the duration of each leg without its ramps: first along its chord, then along the resulting curve.
void set_leg_times_by_speed(std::span<const Waypoint> points, const WaypointOptions& options, WaypointCourse& course) {
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
        throw UserError("closed: the last point repeats the first one; remove the last point");
      fail(i + 1, "has the same pose as the previous point; remove it, or wait there with pause_s");
    }
    course.leg_s.push_back(time_of(i, chord));
    if (course.leg_s.back() < kShortestLeg_s)
      fail(i + 1, "is less than a microsecond after the previous point; remove it, or reduce the speed");
    whole_s += course.leg_s.back() + points[i].pause_s;
    if (!(whole_s <= kMaxTime_s))
      fail(i, fmt::format("has so low a speed that the motion takes more than {:g} s; increase speed", kMaxTime_s));
  }
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<QuinticBezier> path = smooth_path(course);
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

/// The clock on a leg that takes `leg_s`, including its ramps.
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
  WaypointCourse course = course_of(points, options);
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
  // A closed motion has already paused at its first point.
  end_ = arrived + (options.closed ? 0 : to_ns(points.back().pause_s));

  const std::vector<QuinticBezier> path = smooth_path(course);
  for (std::size_t i = 0; i < path.size(); ++i) {
    legs_.push_back({schedule[i].leave, schedule[i].arrive, schedule[i].ramp_in_s, schedule[i].ramp_out_s, path[i]});
  }
}

Kinematics WaypointTrajectory::at(TimeNs t) const {
  require_covered(t);
  // The first leg that has not ended; before it begins, the body rests at its start.
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

}  // namespace esim::inline motion
