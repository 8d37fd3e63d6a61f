#include "esim/evaluate/places.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace esim {
namespace {

constexpr double kFocal = 100;  // px

/// The places of an image whose 1/Z is a function of the pixel.
Image<Place> places_where(const std::function<double(int x, int y)>& nearness) {
  Image<float> depth(24, 16);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const double w = nearness(x, y);
      depth(x, y) = w > 0 ? static_cast<float>(1 / w) : std::numeric_limits<float>::infinity();
    }
  }
  return places_of(depth, kFocal);
}

TEST(Places, APlaneIsSmoothHoweverSlanted) {
  for (const double slope : {0.0, 1.0, 4.0}) {
    const Image<Place> places = places_where([&](int x, int y) { return 0.5 + slope * (x - 0.6 * y) / kFocal / 5; });
    for (const Place place : places.pixels()) EXPECT_EQ(place, Place::surface) << slope;
  }
}

TEST(Places, TwoWallsMeetInACrease) {
  const Image<Place> places = places_where([](int x, int) { return 0.5 - 0.4 * std::fabs(x - 10) / kFocal; });
  for (int x = 2; x < 22; ++x) EXPECT_EQ(places(x, 7), x == 10 ? Place::crease : Place::surface) << x;
}

TEST(Places, WhatIsBehindBeginsAtAnEdge) {
  for (const double behind : {0.25, 0.45, 0.0}) {
    const Image<Place> places = places_where([&](int x, int) { return x < 10 ? 0.5 + 0.001 * x : behind; });
    for (int x = 1; x < 23; ++x) {
      const Place expected = x == 9 || x == 10   ? Place::depth_edge
                             : x == 8 || x == 11 ? Place::near_edge
                                                 : Place::surface;
      EXPECT_EQ(places(x, 7), expected) << x;
    }
  }
}

}  // namespace
}  // namespace esim
