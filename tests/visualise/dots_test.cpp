#include "esim/visualise/dots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

namespace esim {
namespace {

constexpr Rgb kGround{24, 27, 34};

/// Draws by definition: the weight of a dot's colour is opacity times the covered fraction, the farthest dot first.
Image<Rgb> drawn_slowly(std::vector<Dot> dots, Image<Rgb> picture) {
  std::stable_sort(dots.begin(), dots.end(), [](const Dot& a, const Dot& b) { return a.depth > b.depth; });
  for (const Dot& dot : dots) {
    for (int y = 0; y < picture.height(); ++y) {
      for (int x = 0; x < picture.width(); ++x) {
        const float distance = std::hypot(static_cast<float>(x) - dot.x, static_cast<float>(y) - dot.y);
        const float covered = std::clamp(dot.radius + 0.5f - distance, 0.0f, 1.0f);
        picture(x, y) = mix(picture(x, y), dot.colour, static_cast<float>(dot.opacity) / 256 * covered);
      }
    }
  }
  return picture;
}

int largest_difference(const Image<Rgb>& a, const Image<Rgb>& b) {
  int max = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Rgb p = a.pixels()[i], q = b.pixels()[i];
    max = std::max({max, std::abs(p.r - q.r), std::abs(p.g - q.g), std::abs(p.b - q.b)});
  }
  return max;
}

TEST(Dots, AreDrawnAsDefined) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-6, 46), radius(0.75f, 8), unit(0, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const Dot dot{place(random), place(random), radius(random), unit(random), {255, 152, 20}, 200};
    const Image<Rgb> ground(40, 30, kGround);
    Image<Rgb> picture = ground;
    draw_dots({dot}, picture);
    // Errors of 1/32 px in position and 1/16 px in radius, at the steepest edge.
    EXPECT_LE(largest_difference(picture, drawn_slowly({dot}, ground)), 22)
        << dot.x << " " << dot.y << " " << dot.radius;
  }
}

TEST(Dots, OnTheirGridAreExact) {
  Image<Rgb> picture(40, 30, kGround);
  const std::vector<Dot> dots = {{10.25f, 9.5f, 1.5f, 0.2f, {255, 0, 0}, 256}, {11, 10, 3, 0.7f, {0, 0, 255}, 128}};
  const Image<Rgb> expected = drawn_slowly(dots, picture);
  draw_dots(dots, picture);
  EXPECT_LE(largest_difference(picture, expected), 1);
}

TEST(Dots, TheNearestIsInFrontAndOfEqualOnesTheLast) {
  const Rgb red{255, 0, 0}, green{0, 255, 0};
  for (const bool near_first : {true, false}) {
    const Dot near{5, 5, 2, 0, red, 256}, far{5, 5, 2, 1, green, 256};
    Image<Rgb> picture(11, 11, kGround);
    draw_dots(near_first ? std::vector{near, far} : std::vector{far, near}, picture);
    EXPECT_EQ(picture(5, 5), red);
  }
  Image<Rgb> picture(11, 11, kGround);
  draw_dots({{5, 5, 2, 0.5f, red, 256}, {5, 5, 2, 0.5f, green, 256}}, picture);
  EXPECT_EQ(picture(5, 5), green);
  EXPECT_EQ(picture(0, 0), kGround);
}

TEST(Dots, WhatIsOutsideIsCutOff) {
  const Image<Rgb> ground(8, 8, kGround);
  Image<Rgb> picture = ground;
  std::vector<Dot> dots;
  for (const float x : {-100.0f, -1e30f, 1e30f, 100.0f, NAN, INFINITY})
    dots.push_back({x, 4, 2, 0.5f, {255, 255, 255}, 256}), dots.push_back({4, x, 2, NAN, {255, 255, 255}, 256});
  draw_dots(dots, picture);
  EXPECT_EQ(largest_difference(picture, ground), 0);
  draw_dots({{-1, -1, 2, 0, {255, 255, 255}, 256}, {8.5f, 8.5f, 2, 0, {255, 255, 255}, 256}}, picture);
  EXPECT_NE(picture(0, 0), kGround);
  EXPECT_NE(picture(7, 7), kGround);
  EXPECT_EQ(picture(4, 4), kGround);
  draw_dots({}, picture);
}

}  // namespace
}  // namespace esim
