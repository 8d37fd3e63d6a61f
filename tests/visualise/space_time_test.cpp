#include "esim/visualise/space_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace esim {
namespace {

constexpr SpaceTimeBox kBox{.sensor = {64, 48}, .start = 1'000'000, .end = 3'000'000};
constexpr Tile kArea{0, 0, 640, 480};

SpaceTimeProjection::Place at(const SpaceTimeView& view, double x, double y, double t) {
  return SpaceTimeProjection(kBox, view, kArea).place(x, y, t);
}

TEST(SpaceTime, StraightAheadItIsAnImage) {
  // The middle of the sensor does not move over time; the axes are those of the image; newest events are nearest.
  const auto middle = at({}, 31.5, 23.5, 3e6);
  for (const double t : {1e6, 2e6, 3e6}) {
    EXPECT_NEAR(at({}, 31.5, 23.5, t).spot.x, middle.spot.x, 1e-9);
    EXPECT_NEAR(at({}, 31.5, 23.5, t).spot.y, middle.spot.y, 1e-9);
  }
  const auto right = at({}, 41.5, 23.5, 3e6), below = at({}, 31.5, 33.5, 3e6);
  EXPECT_NEAR(right.spot.x - middle.spot.x, 10 * middle.scale, 1e-9);
  EXPECT_NEAR(right.spot.y, middle.spot.y, 1e-9);
  EXPECT_NEAR(below.spot.y - middle.spot.y, 10 * middle.scale, 1e-9);
  EXPECT_NEAR(below.spot.x, middle.spot.x, 1e-9);
  EXPECT_LT(at({}, 31.5, 23.5, 3e6).distance, at({}, 31.5, 23.5, 1e6).distance);
}

TEST(SpaceTime, LinesStayStraight) {
  const SpaceTimeView view = turned_view(0.3);
  const auto first = at(view, 0, 5, 1e6), last = at(view, 60, 40, 3e6);
  for (const double share : {0.2, 0.5, 0.9}) {
    const auto between = at(view, 60 * share, 5 + 35 * share, 1e6 + 2e6 * share);
    const double across = (last.spot.x - first.spot.x) * (between.spot.y - first.spot.y) -
                          (last.spot.y - first.spot.y) * (between.spot.x - first.spot.x);
    EXPECT_NEAR(across, 0, 1e-6);
  }
}

TEST(SpaceTime, SizeIsThatOfAStepAcrossTheLineOfSight) {
  // Along the time axis, sizes are inversely proportional to the distances.
  const auto near = at({}, 10, 10, 3e6), far = at({}, 10, 10, 1e6);
  EXPECT_NEAR(near.scale / far.scale, far.distance / near.distance, 1e-12);
  EXPECT_NEAR(at({}, 11, 10, 1e6).spot.x - far.spot.x, far.scale, 1e-9);
}

TEST(SpaceTime, TheBoxIsInThePictureAtEveryTurn) {
  for (double share = 0; share <= 1; share += 0.05) {
    const SpaceTimeProjection projection(kBox, turned_view(share), kArea);
    for (int corner = 0; corner < 8; ++corner) {
      const Spot spot =
          projection
              .place((corner & 1) != 0 ? 63.5 : -0.5, (corner & 2) != 0 ? 47.5 : -0.5, (corner & 4) != 0 ? 3e6 : 1e6)
              .spot;
      EXPECT_GT(spot.x, 40);
      EXPECT_LT(spot.x, 600);
      EXPECT_GT(spot.y, 40);
      EXPECT_LT(spot.y, 440);
    }
  }
}

TEST(SpaceTime, TurnsToAndFro) {
  EXPECT_NEAR(turned_view(0).yaw_deg, turned_view(1).yaw_deg, 1e-9);
  EXPECT_NEAR(turned_view(0.25).yaw_deg, turned_view(0.75).yaw_deg, 1e-9);
  EXPECT_GT(std::abs(turned_view(0).yaw_deg - turned_view(0.5).yaw_deg), 20);
}

TEST(SpaceTime, AnEventIsDrawnWhereItIsProjected) {
  const SpaceTimeView view = turned_view(0.25);
  const std::vector<Event> none, events = {{2'900'000, 30, 20, 1}};
  const Image<Rgb> before = draw_space_time(none, kBox, view, kArea.width, kArea.height, kDarkTheme);
  const Image<Rgb> after = draw_space_time(events, kBox, view, kArea.width, kArea.height, kDarkTheme);
  const auto place = at(view, 30, 20, 2'900'000);
  int changed = 0;
  for (int y = 0; y < kArea.height; ++y) {
    for (int x = 0; x < kArea.width; ++x) {
      if (before(x, y) == after(x, y)) continue;
      ++changed;
      EXPECT_LT(std::hypot(x - place.spot.x, y - place.spot.y), place.scale + 1);
      EXPECT_GT(after(x, y).r - before(x, y).r, after(x, y).b - before(x, y).b);  // ON is orange
    }
  }
  EXPECT_GT(changed, 3);
}

TEST(SpaceTime, WhatIsOutsideTheTimeIsNotDrawn) {
  const SpaceTimeView view = turned_view(0.25);
  const std::vector<Event> none, events = {{999'999, 30, 20, 1}, {3'000'001, 30, 20, 1}};
  EXPECT_TRUE(std::ranges::equal(draw_space_time(none, kBox, view, 200, 150, kDarkTheme).pixels(),
                                 draw_space_time(events, kBox, view, 200, 150, kDarkTheme).pixels()));
}

}  // namespace
}  // namespace esim
