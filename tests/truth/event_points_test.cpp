#include "esim/truth/event_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "render/scenes.h"

namespace esim {
namespace {

constexpr TimeSpan kCovered = {0, 100 * kNsPerMs};

RenderRequest view_at(TimeNs t) {
  EXPECT_TRUE(t >= kCovered.start && t <= kCovered.end);
  RenderRequest request{t, test::moving_camera(), {}};
  request.camera.T_world_body.translation += request.camera.velocity_world * to_seconds(t);
  request.camera.T_world_body.rotation =
      request.camera.T_world_body.rotation * so3_exp(request.camera.omega_body * to_seconds(t));
  return request;
}

std::vector<Event> some_events(const Camera& camera, int count) {
  std::mt19937 random(1);
  std::vector<Event> events;
  for (int i = 0; i < count; ++i) {
    events.push_back({static_cast<TimeNs>(random() % 100'000'000),
                      static_cast<std::uint16_t>(random() % static_cast<unsigned>(camera.width)),
                      static_cast<std::uint16_t>(random() % static_cast<unsigned>(camera.height)), 1});
  }
  std::sort(events.begin(), events.end());
  return events;
}

EventPoints points_on(const TexturedPlane& plane, const Camera& camera, const Workers& workers) {
  const auto make_renderer = [&](const Camera& model, const Workers& alone) {
    return make_plane_renderer(plane, model, alone);
  };
  return {camera, make_renderer, view_at, kCovered, workers};
}

TEST(EventPoints, LieWhereTheRayOfTheEventMeetsThePlane) {
  const TexturedPlane plane = test::test_plane();
  for (int kind = 0; kind < 4; ++kind) {
    const Camera camera = test::distorted_camera(kind);
    const std::vector<Event> events = some_events(camera, 2000);
    std::vector<Eigen::Vector3f> points;
    points_on(plane, camera, test::two_threads()).locate(events, points);
    ASSERT_EQ(points.size(), events.size());
    for (std::size_t i = 0; i < events.size(); ++i) {
      const SE3 T_world_camera = view_at(events[i].t).camera.T_world_body;
      const SE3 T_plane_camera = plane.T_world_plane.inverse() * T_world_camera;
      const Eigen::Vector3d bearing = camera.back_project(Eigen::Vector2d(events[i].x, events[i].y))->bearing;
      const double depth = -T_plane_camera.translation.z() / (T_plane_camera.rotation * bearing).z();
      const Eigen::Vector3d expected = T_world_camera * (depth * bearing);
      ASSERT_LT((points[i].cast<double>() - expected).norm(), 1e-5 * depth) << i << ", distortion " << kind;
    }
  }
}

TEST(EventPoints, DoNotDependOnThreadsOrOnWhatElseIsAsked) {
  const Camera camera = test::distorted_camera(1);
  const std::vector<Event> events = some_events(camera, 1000);
  const Workers one(1);
  std::vector<Eigen::Vector3f> all, some;
  points_on(test::test_plane(), camera, test::two_threads()).locate(events, all);
  EventPoints points = points_on(test::test_plane(), camera, one);
  for (std::size_t i = 0; i < events.size(); i += 7) {
    points.locate(EventSpan(events).subspan(i, 1), some);
    ASSERT_EQ(some.size(), 1U);
    ASSERT_EQ(some[0], all[i]);
  }
  points.locate({}, some);
  EXPECT_TRUE(some.empty());
}

TEST(EventPoints, AreNoneWhereNothingIsSeenAndThoseOfTheEndAfterIt) {
  TexturedPlane plane = test::test_plane();
  plane.endless = false;
  plane.width_m = 0.5;
  const Camera camera = test::distorted_camera(0);
  EventPoints points = points_on(plane, camera, test::two_threads());
  std::vector<Eigen::Vector3f> found;
  const SE3 T_camera_world = view_at(kCovered.end).camera.T_world_body.inverse();
  const Eigen::Vector2d centre = camera.project(T_camera_world * plane.T_world_plane.translation)->pixel;
  const auto x = static_cast<std::uint16_t>(centre.x()), y = static_cast<std::uint16_t>(centre.y());
  const std::vector<Event> events = {{1000, 119, 89, 1}, {kCovered.end, x, y, 1}, {kCovered.end + 5000, x, y, 1}};
  points.locate(events, found);
  EXPECT_TRUE(std::isnan(found[0].x()) && std::isnan(found[0].y()) && std::isnan(found[0].z()));
  EXPECT_TRUE(found[1].allFinite());
  EXPECT_EQ(found[1], found[2]);
}

}  // namespace
}  // namespace esim
