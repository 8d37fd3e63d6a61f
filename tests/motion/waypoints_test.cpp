#include "esim/motion/waypoints/waypoints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Vector3d;
using test::contains;
using test::largest_difference;
using test::numeric_derivative;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = std::numbers::pi;

Waypoint at_place(double x, double y = 0, double z = 0) {
  return {{Eigen::Quaterniond::Identity(), {x, y, z}}, {}, {}, 0};
}

Waypoint timed(Waypoint point, double t_s) {
  point.t_s = t_s;
  return point;
}

Waypoint turned(Waypoint point, const Vector3d& turn) {
  point.T_world_body.rotation = so3_exp(turn);
  return point;
}

Waypoint paused(Waypoint point, double pause_s) {
  point.pause_s = pause_s;
  return point;
}

std::vector<Waypoint> scattered(std::size_t count, bool with_times) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Waypoint> points;
  double t_s = 2.5;
  for (std::size_t i = 0; i < count; ++i) {
    Waypoint point = turned(at_place(3 * uniform(engine), 3 * uniform(engine), uniform(engine)),
                            {uniform(engine), uniform(engine), uniform(engine)});
    t_s += 1.2 + uniform(engine);
    if (with_times) point.t_s = t_s;
    if (i % 4 == 2) point.pause_s = 0.15;
    points.push_back(point);
  }
  return points;
}

/// Motions of every kind.
std::vector<std::pair<std::vector<Waypoint>, WaypointOptions>> motions() {
  WaypointOptions moving, closed, loop;
  moving.rest = false;
  closed.closed = true;
  loop.closed = true, loop.rest = false;
  std::vector<Waypoint> ring = scattered(6, false);
  for (Waypoint& point : ring) point.pause_s = 0;
  std::vector<Waypoint> fast = scattered(5, false);
  fast[1].speed_m_per_s = 4;
  const std::vector<Waypoint> about{at_place(0), at_place(2), turned(at_place(2), {0, 0, 1.5}), at_place(2, 2)};
  return {{scattered(9, true), {}},
          {scattered(9, true), moving},
          {scattered(9, false), {}},
          {scattered(9, false), moving},
          {scattered(7, false), closed},
          {ring, loop},
          {scattered(7, false), loop},
          {fast, {}},
          {about, {}},
          {about, moving},
          {{at_place(0), at_place(1)}, {}},
          {{at_place(0), at_place(1)}, loop},
          {{at_place(0), at_place(1), at_place(0)}, {}},
          {{timed(at_place(0), 1), timed(at_place(1), 1.5), timed(at_place(1.5), 10)}, {}}};
}

TEST(Waypoints, ArePassedThrough) {
  for (const auto& [points, options] : motions()) {
    const WaypointTrajectory trajectory(points, options);
    const std::vector<TimeNs> arrivals = trajectory.arrivals();
    ASSERT_EQ(arrivals.size(), points.size() + (options.closed ? 1 : 0));
    EXPECT_EQ(arrivals.front(), trajectory.start());
    for (std::size_t i = 0; i < arrivals.size(); ++i) {
      const Waypoint& point = points[i % points.size()];
      if (point.t_s) {
        EXPECT_EQ(arrivals[i], to_ns(*point.t_s));
      }
      const double pause_s = i < points.size() ? point.pause_s : 0.0;
      for (const double wait : {0.0, 0.5, 1.0}) {
        const SE3 pose = trajectory.at(arrivals[i] + to_ns(wait * pause_s)).T_world_body;
        EXPECT_LT((pose.translation - point.T_world_body.translation).norm(), 1e-8) << i;
        EXPECT_LT(pose.rotation.angularDistance(point.T_world_body.rotation), 1e-7) << i;
      }
    }
  }
}

TEST(Waypoints, DerivativesAreThoseOfThePose) {
  for (const auto& [points, options] : motions()) {
    const WaypointTrajectory trajectory(points, options);
    const double start_s = to_seconds(trajectory.start()), duration_s = to_seconds(trajectory.end()) - start_s;
    // Differences do not cross joints, where third derivatives jump and would cause small errors.
    const double step = 2e-3;
    double worst = 0;
    std::vector<double> errors;
    for (int k = 1; k < 400; ++k) {
      const double t_s = start_s + duration_s * (k + 0.37) / 401;
      const auto at = [&](double s) { return trajectory.at(to_ns(s)); };
      const Kinematics here = at(t_s);
      const auto position = [&](double s) -> Vector3d { return at(s).T_world_body.translation; };
      const auto velocity = [&](double s) -> Vector3d { return at(s).velocity_world; };
      const auto turn = [&](double s) -> Vector3d {
        return so3_log((here.T_world_body.rotation.conjugate() * at(s).T_world_body.rotation).normalized());
      };
      const auto rate = [&](double s) -> Vector3d { return at(s).omega_body; };
      if (t_s - 2 * step < start_s || t_s + 2 * step > start_s + duration_s) continue;
      errors.push_back(largest_difference(here.velocity_world, numeric_derivative(position, t_s, step)) /
                       (1 + here.velocity_world.norm()));
      errors.push_back(largest_difference(here.omega_body, numeric_derivative(turn, t_s, step)) /
                       (1 + here.omega_body.norm()));
      worst = std::max({worst, errors.back(), errors[errors.size() - 2]});
      const double linear = largest_difference(here.acceleration_world, numeric_derivative(velocity, t_s, step)),
                   angular = largest_difference(here.alpha_body, numeric_derivative(rate, t_s, step));
      errors.push_back(linear / (1 + here.acceleration_world.norm()));
      errors.push_back(angular / (1 + here.alpha_body.norm()));
    }
    EXPECT_LT(worst, 2e-3);
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() * 9 / 10], 2e-5);
  }
}

TEST(Waypoints, TwistAndAccelerationAreContinuous) {
  for (const auto& [points, options] : motions()) {
    const WaypointTrajectory trajectory(points, options);
    const std::vector<TimeNs> arrivals = trajectory.arrivals();
    std::vector<TimeNs> joints;
    for (std::size_t i = 0; i < arrivals.size(); ++i) {
      joints.push_back(arrivals[i]);
      if (i < points.size()) joints.push_back(arrivals[i] + to_ns(points[i].pause_s));
    }
    for (const TimeNs joint : joints) {
      if (joint <= trajectory.start() || joint >= trajectory.end()) continue;
      const Kinematics before = trajectory.at(joint - 1), after = trajectory.at(joint + 1);
      EXPECT_LT(largest_difference(before.velocity_world, after.velocity_world), 1e-6);
      EXPECT_LT(largest_difference(before.acceleration_world, after.acceleration_world), 1e-5);
      EXPECT_LT(largest_difference(before.omega_body, after.omega_body), 1e-6);
      EXPECT_LT(largest_difference(before.alpha_body, after.alpha_body), 1e-5);
    }
  }
}

TEST(Waypoints, RestAtTheEndsAndInPauses) {
  const std::vector<Waypoint> points = scattered(9, false);
  const WaypointTrajectory trajectory(points, {});
  const auto expect_rest = [&](TimeNs t) {
    const Kinematics here = trajectory.at(t);
    EXPECT_LT(here.velocity_world.norm() + here.omega_body.norm(), 1e-9);
    EXPECT_LT(here.acceleration_world.norm() + here.alpha_body.norm(), 1e-6);
  };
  expect_rest(trajectory.start());
  expect_rest(trajectory.end());
  expect_rest(trajectory.arrivals()[2] + to_ns(0.07));

  WaypointOptions moving;
  moving.rest = false;
  const std::vector<Waypoint> straight{at_place(0), at_place(1), at_place(3)};
  const WaypointTrajectory on_the_way(straight, moving);
  EXPECT_EQ(on_the_way.end(), 3 * kNsPerSecond);
  for (const double t_s : {0.0, 0.5, 1.0, 2.9, 3.0}) {
    EXPECT_LT(largest_difference(on_the_way.at(to_ns(t_s)).velocity_world, Vector3d(1, 0, 0)), 1e-9) << t_s;
    EXPECT_NEAR(on_the_way.at(to_ns(t_s)).T_world_body.translation.x(), t_s, 1e-9);
  }
}

TEST(Waypoints, SpeedIsReachedOnStraightLegs) {
  std::vector<Waypoint> points{at_place(0), at_place(3), at_place(5), at_place(11)};
  points[2].speed_m_per_s = 2;
  WaypointOptions options;
  options.speed_m_per_s = 1.5;
  options.ramp_s = 0.4;
  const WaypointTrajectory trajectory(points, options);
  const std::vector<TimeNs> arrivals = trajectory.arrivals();
  // Each ramp adds half of its duration.
  EXPECT_NEAR(to_seconds(arrivals[1]), 3 / 1.5 + 0.2, 0.05);
  EXPECT_NEAR(to_seconds(trajectory.end()), 5 / 1.5 + 6 / 2.0 + 2 * 0.2, 0.05);
  EXPECT_NEAR(trajectory.at(to_ns(1.0)).velocity_world.norm(), 1.5, 0.075);
  EXPECT_NEAR(trajectory.at((arrivals[2] + arrivals[3]) / 2).velocity_world.norm(), 2.0, 0.1);
  double fastest = 0;
  for (TimeNs t = 0; t < trajectory.end(); t += 10 * kNsPerMs)
    fastest = std::max(fastest, trajectory.at(t).velocity_world.norm());
  EXPECT_LT(fastest, 2.2);
}

TEST(Waypoints, ALegBetweenTwoStopsIsStraightAndEven) {
  const std::vector<Waypoint> points{at_place(0), paused(at_place(2), 0.3), at_place(2, 3)};
  const WaypointTrajectory trajectory(points, {});
  for (TimeNs t = 0; t <= trajectory.end(); t += 10 * kNsPerMs) {
    const Kinematics here = trajectory.at(t);
    const Vector3d position = here.T_world_body.translation;
    EXPECT_LT(std::min(std::abs(position.y()), std::abs(position.x() - 2)), 1e-12);
    EXPECT_LT(here.velocity_world.norm(), 1 + 1e-12);
  }
  EXPECT_NEAR(trajectory.at(kNsPerSecond).velocity_world.x(), 1, 1e-12);
  EXPECT_NEAR(to_seconds(trajectory.end()), 2 + 0.5 + 0.3 + 3 + 0.5, 1e-8);
}

TEST(Waypoints, TurningOnTheSpotStaysThereAndKeepsToItsRate) {
  const std::vector<Waypoint> points{at_place(0), at_place(2), turned(at_place(2), {0, 0, kPi / 2}),
                                     turned(at_place(2, 2), {0, 0, kPi / 2})};
  WaypointOptions options;
  options.turn_rad_per_s = 0.5;
  const WaypointTrajectory trajectory(points, options);
  const std::vector<TimeNs> arrivals = trajectory.arrivals();
  EXPECT_NEAR(to_seconds(arrivals[2] - arrivals[1]), kPi / 2 / 0.5 + 0.5, 1e-8);
  double fastest = 0;
  for (TimeNs t = 0; t <= trajectory.end(); t += 10 * kNsPerMs) {
    const Kinematics here = trajectory.at(t);
    fastest = std::max(fastest, here.omega_body.norm());
    if (t >= arrivals[1] && t <= arrivals[2]) {
      EXPECT_LT((here.T_world_body.translation - Vector3d(2, 0, 0)).norm(), 1e-12);
    } else {
      EXPECT_LT(here.omega_body.norm(), 1e-12);
    }
  }
  EXPECT_LT(fastest, 0.5 + 1e-9);
  EXPECT_GT(fastest, 0.499);
}

TEST(Waypoints, ACircleIsRoundAndSmooth) {
  std::vector<Waypoint> points;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * kPi * i / 12;
    points.push_back(turned(at_place(2 * std::cos(angle), 2 * std::sin(angle)), {0, 0, angle}));
  }
  WaypointOptions options;
  options.closed = true, options.rest = false;
  const WaypointTrajectory trajectory(points, options);
  EXPECT_NEAR(to_seconds(trajectory.end()), 4 * kPi, 0.01);
  for (TimeNs t = 0; t <= trajectory.end(); t += 50 * kNsPerMs) {
    const Kinematics here = trajectory.at(t);
    EXPECT_NEAR(here.T_world_body.translation.norm(), 2, 0.002);
    EXPECT_NEAR(here.velocity_world.norm(), 1, 0.01);
    EXPECT_NEAR(here.acceleration_world.norm(), 0.5, 0.05);
    EXPECT_NEAR(here.omega_body.z(), 0.5, 0.01);
  }
  const Kinematics start = trajectory.at(0), end = trajectory.at(trajectory.end());
  EXPECT_LT(largest_difference(start.velocity_world, end.velocity_world), 1e-9);
  EXPECT_LT(largest_difference(start.acceleration_world, end.acceleration_world), 1e-8);
  EXPECT_LT(largest_difference(start.alpha_body, end.alpha_body), 1e-8);
}

TEST(Waypoints, UnevenTimesDoNotOvershoot) {
  const std::vector<Waypoint> points{timed(at_place(0), 0), timed(at_place(1), 0.1), timed(at_place(1.5), 10),
                                     timed(at_place(1.5), 11), timed(at_place(9), 11.5)};
  const WaypointTrajectory trajectory(points, {});
  double before = 0;
  for (TimeNs t = 0; t <= trajectory.end(); t += kNsPerMs) {
    const double x = trajectory.at(t).T_world_body.translation.x();
    EXPECT_GE(x, before - 1e-9);
    if (t >= to_ns(10) && t <= to_ns(11)) {
      EXPECT_NEAR(x, 1.5, 1e-12);
    }
    before = x;
  }
}

TEST(Waypoints, SayWhatIsWrongWithThem) {
  const auto error = [](const std::vector<Waypoint>& points, const WaypointOptions& options = {}) {
    return test::message_of<UserError>([&] { WaypointTrajectory(points, options); });
  };
  EXPECT_TRUE(contains(error({}), "at least two"));
  EXPECT_TRUE(contains(error({at_place(1)}), "1 point, but a motion needs at least two"));
  EXPECT_TRUE(contains(error({timed(at_place(0), 1), timed(at_place(1), 1)}),
                       "points.1: t: 1 s is also the time of the previous point"));
  EXPECT_TRUE(
      contains(error({timed(at_place(0), 1), timed(at_place(1), 0.5)}), "points.1: t: 0.5 s is before the 1 s"));
  EXPECT_TRUE(contains(error({timed(at_place(0), 1), at_place(1)}), "points.1: has no t"));
  EXPECT_TRUE(contains(error({at_place(0), timed(at_place(1), 1)}), "points.1: has t"));
  Waypoint both = timed(at_place(0), 1);
  both.speed_m_per_s = 1;
  EXPECT_TRUE(contains(error({both, timed(at_place(1), 2)}), "points.0: has both t and speed"));
  EXPECT_TRUE(contains(error({at_place(0), at_place(kNan)}), "points.1: is not finite"));
  EXPECT_TRUE(contains(error({timed(at_place(0), 0), timed(at_place(1), kNan)}), "points.1: t: nan"));
  EXPECT_TRUE(
      contains(error({at_place(0), at_place(1), at_place(1)}), "points.2: has the same pose as the previous point"));
  EXPECT_TRUE(contains(error({timed(paused(at_place(0), 2), 0), timed(at_place(1), 2)}), "points.0: pause_s"));
  EXPECT_TRUE(contains(error({paused(at_place(0), -1), at_place(1)}), "points.0: pause_s"));
  Waypoint backwards = at_place(0);
  backwards.speed_m_per_s = -1;
  EXPECT_TRUE(contains(error({backwards, at_place(1)}), "points.0: speed"));
  WaypointOptions closed, slow, sudden;
  closed.closed = true;
  EXPECT_TRUE(contains(error({timed(at_place(0), 1), timed(at_place(1), 2)}, closed), "closed"));
  EXPECT_TRUE(contains(error({at_place(0), at_place(1), at_place(0)}, closed), "remove the last point"));
  slow.speed_m_per_s = 1e-12;
  EXPECT_TRUE(contains(error({at_place(0), at_place(1)}, slow), "increase speed"));
  sudden.ramp_s = 0;
  EXPECT_TRUE(contains(error({at_place(0), at_place(1)}, sudden), "ramp_s"));
}

}  // namespace
}  // namespace esim
