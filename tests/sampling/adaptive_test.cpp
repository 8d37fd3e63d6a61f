#include "esim/sampling/adaptive/adaptive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace esim {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr double kEps = 0.001, kThreshold = 0.3;

/// Brightness and motion of a pixel as functions of time in seconds.
struct Movie {
  std::function<double(double x, double y, double t)> brightness;
  std::function<double(double x, double y, double t)> speed;  // to the right, px/s
};

/// A textured wall that passes from left to right.
Movie passing_wall(double px_per_s) {
  const auto turn = [](double x, double wavelength) { return std::sin(2 * std::numbers::pi * x / wavelength); };
  return {[=](double x, double y, double t) {
            return -1 + 0.6 * turn(x - px_per_s * t, 11) * turn(y, 17) + 0.4 * turn(x - px_per_s * t + y, 29);
          },
          [=](double, double, double) { return px_per_s; }};
}

/// A smooth bar that moves through the middle of a dark, motionless image.
Movie flying_bar(double px_per_s) {
  const auto offset = [=](double x, double t) { return (x + 20 - px_per_s * t) / 3; };
  return {[=](double x, double y, double t) {
            return std::abs(y - 32) < 6 ? -3 + 3 * std::exp(-offset(x, t) * offset(x, t)) : -3;
          },
          [=](double x, double y, double t) {
            return std::abs(y - 32) < 6 && std::abs(offset(x, t)) < 3 ? px_per_s : 0.0;
          }};
}

/// Bright lines, one pixel wide and blurred only by the pixels' area, that move over a dark, uniform image: at any time
/// only a few pixels change, but abruptly.
Movie passing_lines(double px_per_s, double distance_px) {
  // Length of the lines within [0, x].
  const auto covered = [=](double x) {
    const double lines = std::floor(x / distance_px);
    return lines + std::min(x - lines * distance_px, 1.0);
  };
  return {[=](double x, double y, double t) {
            const double left = x + 0.1 * y - px_per_s * t - 0.5;
            return std::log(0.1 + 0.15 * (covered(left + 1) - covered(left)));
          },
          [=](double, double, double) { return px_per_s; }};
}

struct Outcome {
  std::vector<double> errors;  // |L - truth| of the segments, at random pixels and times
  SamplingStatistics statistics;
  double digest = 0;

  double quantile(double share) const {
    std::vector<double> sorted = errors;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  double evaluations_per_pixel() const {
    return static_cast<double>(statistics.pixel_evaluations) / (kWidth * kHeight);
  }
};

/// Evaluates the tiles of one time.
void evaluate(const TilesAt& wanted, const Movie& movie, Sample& sample) {
  const double t = to_seconds(wanted.t);
  for (const Tile& tile : wanted.tiles) {
    sample.tiles.push_back(tile);
    for (int y = tile.y; y < tile.y + tile.height; ++y) {
      for (int x = tile.x; x < tile.x + tile.width; ++x) {
        sample.irradiance(x, y) = static_cast<float>(std::exp(movie.brightness(x, y, t)) - kEps);
        sample.motion_x(x, y) = static_cast<float>(movie.speed(x, y, t)), sample.motion_y(x, y) = 0;
      }
    }
  }
}

void answer(const SampleRequest& request, const Movie& movie, Sample& sample) {
  sample.resize(kWidth, kHeight);
  sample.t = request.t, sample.tiles.clear();
  evaluate({request.t, request.tiles}, movie, sample);
  for (const TilesAt& wanted : request.later) evaluate(wanted, movie, sample);
}

Outcome sample(const AdaptiveSampling& options, const Movie& movie, TimeNs end, int threads = 2) {
  const Workers workers(threads);
  const auto sampler = make_adaptive_sampler(options, {{kThreshold, kEps}, kWidth, kHeight, {0, end}, workers});
  Outcome outcome;
  Sample sample;
  while (const auto request = sampler->next()) {
    answer(*request, movie, sample);
    for (const Segment& segment : sampler->accept(sample)) {
      // One pixel per segment, at a varying position, so that all times have equal weight.
      const int x = segment.tile.x + static_cast<int>(segment.t1 / 7 % segment.tile.width);
      const int y = segment.tile.y + static_cast<int>(segment.t1 / 13 % segment.tile.height);
      const double l0 = std::log(double{segment.irradiance0(x, y)} + kEps);
      const double l1 = std::log(double{segment.irradiance1(x, y)} + kEps);
      outcome.digest += l1 * to_seconds(segment.t1 - segment.t0) + to_seconds(segment.t0);
      constexpr TimeNs kEvery = 50 * kNsPerUs;
      for (TimeNs t = segment.t0 / kEvery * kEvery + kEvery; t <= segment.t1; t += kEvery) {
        const double share = static_cast<double>(t - segment.t0) / static_cast<double>(segment.t1 - segment.t0);
        outcome.errors.push_back(std::abs(l0 + (l1 - l0) * share - movie.brightness(x, y, to_seconds(t))));
      }
    }
  }
  outcome.statistics = sampler->statistics();
  return outcome;
}

TEST(AdaptiveSampling, WhatDoesNotChangeCostsTheMinimumRate) {
  const Movie still{[](double x, double y, double) { return -2 + std::sin(x + y * y); },
                    [](double, double, double) { return 0.0; }};
  const Outcome outcome = sample({}, still, kNsPerSecond);
  EXPECT_GE(outcome.evaluations_per_pixel(), 20);
  EXPECT_LE(outcome.evaluations_per_pixel(), 27) << "times on a grid are up to an eighth earlier";
  EXPECT_LE(outcome.quantile(1), 1e-5);
}

// 99 % of the true errors stay below the tolerance, and half the tolerance halves the error.
TEST(AdaptiveSampling, KeepsTheTolerance) {
  const Movie wall = passing_wall(400);
  double error_before = 0, evaluations_before = 0;
  for (const double tolerance : {0.4, 0.2, 0.1, 0.05}) {
    const Outcome outcome = sample({.tolerance = tolerance}, wall, kNsPerSecond / 4);
    EXPECT_LE(outcome.quantile(0.99), tolerance * kThreshold) << tolerance;
    ASSERT_TRUE(outcome.statistics.measured_error.has_value());
    EXPECT_LE(outcome.statistics.measured_error->p99, tolerance * kThreshold) << tolerance;
    if (error_before > 0) {
      EXPECT_LT(outcome.quantile(0.99), 0.75 * error_before) << tolerance;
      EXPECT_LT(outcome.evaluations_per_pixel(), 2 * evaluations_before) << tolerance;
    }
    error_before = outcome.quantile(0.99), evaluations_before = outcome.evaluations_per_pixel();
  }
}

// The same if few pixels have most of the error, as in a room with edges: the errors of a tile are far from normal.
TEST(AdaptiveSampling, KeepsTheToleranceWhereOnlyEdgesChange) {
  for (const double tolerance : {0.4, 0.2, 0.1}) {
    const Outcome outcome = sample({.tolerance = tolerance}, passing_lines(400, 24), kNsPerSecond / 4);
    EXPECT_LE(outcome.quantile(0.99), tolerance * kThreshold) << tolerance;
  }
}

// Before any audit has measured the distribution of the errors.
TEST(AdaptiveSampling, KeepsTheToleranceFromTheStart) {
  for (const double tolerance : {0.4, 0.2, 0.1}) {
    for (const double distance_px : {6, 12, 24}) {
      const Outcome start = sample({.tolerance = tolerance}, passing_lines(400, distance_px), kNsPerSecond / 40);
      EXPECT_LE(start.quantile(0.99), tolerance * kThreshold) << tolerance << ", lines every " << distance_px << " px";
    }
  }
}

TEST(AdaptiveSampling, MeasuresItsErrorHonestly) {
  const Outcome outcome = sample({.tolerance = 0.2}, passing_wall(400), kNsPerSecond);
  // Audits measure in the middle of intervals, where errors are largest.
  EXPECT_GT(outcome.statistics.measured_error->p99, 0.8 * outcome.quantile(0.99));
  EXPECT_LT(outcome.statistics.measured_error->p99, 4 * outcome.quantile(0.99));
  EXPECT_GT(outcome.statistics.audits, 20);
}

// If one object moves through a static image, only its surroundings are sampled, and its motion is never missed.
TEST(AdaptiveSampling, FollowsWhatMoves) {
  const Movie bar = flying_bar(600);
  const Outcome outcome = sample({.tolerance = 0.2}, bar, kNsPerSecond / 5);
  EXPECT_LE(outcome.quantile(0.99), 0.2 * kThreshold);
  EXPECT_LE(outcome.quantile(0.9995), kThreshold) << "the bar entered a tile without being noticed";
  const double flow_half_px = 600 / 0.5 / 5;
  EXPECT_LE(outcome.evaluations_per_pixel(), 0.4 * flow_half_px);
}

// The motion field does not show a light that flickers.
TEST(AdaptiveSampling, NoticesFlicker) {
  const Movie flicker{[](double, double, double t) { return -1 + 0.5 * std::sin(2 * std::numbers::pi * 23 * t); },
                      [](double, double, double) { return 0.0; }};
  const Outcome outcome = sample({.tolerance = 0.2}, flicker, kNsPerSecond);
  EXPECT_LE(outcome.quantile(0.99), 0.2 * kThreshold);
}

TEST(AdaptiveSampling, IsTheSameWithAnyNumberOfThreads) {
  const Outcome one = sample({}, passing_wall(300), kNsPerSecond / 10, 1);
  const Outcome two = sample({}, passing_wall(300), kNsPerSecond / 10, 2);
  EXPECT_EQ(one.digest, two.digest);
  EXPECT_EQ(one.statistics.pixel_evaluations, two.statistics.pixel_evaluations);
  EXPECT_EQ(one.errors, two.errors);
}

TEST(AdaptiveSampling, EndsWhereMotionIsNotFinite) {
  Movie wall = passing_wall(100);
  wall.speed = [](double x, double, double) {
    return x < 10 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_LE(sample({.tolerance = 0.2}, wall, kNsPerSecond / 10).quantile(0.99), 0.2 * kThreshold);
}

// Noise cannot be interpolated at any rate: sampling stops at the maximum rate, which is reported.
TEST(AdaptiveSampling, StopsAtTheHighestRate) {
  const Movie noise{[](double x, double y, double t) {
                      const double v = std::sin(x * 12.9898 + y * 78.233 + t * 1e7) * 43758.5453;
                      return -1 + (v - std::floor(v));
                    },
                    [](double, double, double) { return 10.0; }};
  const Outcome outcome = sample({.tolerance = 0.1, .bounds = {50, 2000}}, noise, kNsPerSecond / 50);
  EXPECT_GT(outcome.statistics.held_to_max_rate, 0);
  EXPECT_LE(outcome.evaluations_per_pixel(), 2000 / 50 * 1.1 + 3);
}

}  // namespace
}  // namespace esim
