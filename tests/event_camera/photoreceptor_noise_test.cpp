// The lazily evaluated noise of the photoreceptor against its stationary statistics. circuit_pixel_test.cpp compares
// its events with those of short steps.
#include "esim/event_camera/circuit/photoreceptor_noise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <future>
#include <vector>

#include "esim/core/error.h"

namespace esim {
namespace {

constexpr double kMs = 1e6;  // ns

PhotoreceptorNoise make_noise(double t1_ms = 5, double t2_ms = 1.5, std::uint64_t seed = 1) {
  return {1.0, t2_ms * kMs, t1_ms * kMs, t1_ms * kMs, AddressedRandom(seed, Purpose::test)};
}

/// A pixel in steady light that makes steps.
struct Steps {
  const PhotoreceptorNoise& noise;
  std::uint32_t pixel;
  NoiseState from, to;
  std::uint32_t node = 1;

  Steps(const PhotoreceptorNoise& noise_, std::uint32_t pixel_) : noise(noise_), pixel(pixel_) {
    from = noise.first(pixel, 0);
    to = step(from);
  }
  NoiseState step(const NoiseState& state) const {
    PhotoreceptorNoise::Draws draws;
    const std::uint32_t even = node & ~1U;
    noise.draw(1, &pixel, &even, draws);
    return noise.after_step(state, {draws[node - even][0][0], draws[node - even][1][0]}, 0, 0);
  }
  void next() {
    from = to;
    ++node;
    to = step(from);
  }
  double at(double tau) const { return noise.at(noise.path(from, to, pixel, node, 0), tau, 0); }
};

constexpr std::array<std::pair<double, double>, 4> kTimeConstants_ms{
    {{5.0, 1.5}, {100.0, 1.5}, {0.15, 1.5}, {1.5, 1.5}}};
constexpr int kPixels = 40'000;
const double kTolerance = 4 * std::sqrt(2.0 / kPixels);

/// Autocovariance of x.
double expected_covariance(const PhotoreceptorNoise& noise, double lag) {
  const double t1 = noise.t1_ns(0), t2 = noise.t2_ns();
  return t1 / (t1 + t2) * (t1 * std::exp(-lag / t1) - t2 * std::exp(-lag / t2)) / (t1 - t2);
}

TEST(PhotoreceptorNoise, ThreadsFindTheSamePoles) {
  const auto make = [] {
    return PhotoreceptorNoise(1.0, 1.5 * kMs, 1 * kMs, 3 * kMs, AddressedRandom(1, Purpose::test));
  };
  const PhotoreceptorNoise shared = make();
  const std::int32_t last = shared.pole_of(std::log(3 * kMs));
  const auto steps = [last](const PhotoreceptorNoise& noise) {
    std::vector<double> found;
    for (std::int32_t pole = 0; pole <= last; ++pole) found.push_back(noise.step_ns(pole));
    return found;
  };
  std::vector<std::future<std::vector<double>>> all;
  for (int i = 0; i < 4; ++i) all.push_back(std::async(std::launch::async, steps, std::cref(shared)));
  const std::vector<double> expected = steps(make());
  for (auto& found : all) EXPECT_EQ(found.get(), expected);
}

TEST(PhotoreceptorNoise, StepsKeepTheVarianceAndTheMemoryOfTheCircuit) {
  for (const auto& [t1_ms, t2_ms] : kTimeConstants_ms) {
    const PhotoreceptorNoise noise = make_noise(t1_ms, t2_ms);
    const double t1 = noise.t1_ns(0), s2 = t1 / (t1 + noise.t2_ns());
    EXPECT_NEAR(noise.deviation(0), std::sqrt(s2), 1e-12);
    double xx = 0, yy = 0, xy = 0, lagged = 0;
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      Steps steps(noise, i);
      const double before = steps.from.x;
      for (int k = 1; k < 6; ++k) steps.next();
      const NoiseState& a = steps.to;
      xx += a.x * a.x, yy += a.y * a.y, xy += a.x * a.y, lagged += before * a.x;
    }
    EXPECT_NEAR(yy / kPixels, 1.0, kTolerance) << t1_ms;
    EXPECT_NEAR(xx / kPixels, s2, kTolerance * s2) << t1_ms;
    EXPECT_NEAR(xy / kPixels, s2, kTolerance) << t1_ms;
    EXPECT_NEAR(lagged / kPixels, expected_covariance(noise, 6 * noise.step_ns(0)), kTolerance * s2) << t1_ms;
  }
}

TEST(PhotoreceptorNoise, IsTheSameProcessWithinSteps) {
  for (const auto& [t1_ms, t2_ms] : kTimeConstants_ms) {
    const PhotoreceptorNoise noise = make_noise(t1_ms, t2_ms);
    const double h = noise.step_ns(0), lag = 0.3 * h, s2 = noise.deviation(0) * noise.deviation(0);
    double xx = 0, difference2 = 0, residual2 = 0;
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      Steps steps(noise, i);
      for (int k = 1; k < 3; ++k) steps.next();
      const double tau = (0.02 + 0.66 * (i % 97) / 97.0) * h, a = steps.at(tau), b = steps.at(tau + lag);
      xx += a * a, difference2 += (b - a) * (b - a);
      const NoiseCubic whole{steps.from.x, (steps.from.y - steps.from.x) / noise.t2_ns(), steps.to.x,
                             (steps.to.y - steps.to.x) / noise.t2_ns(), h};
      residual2 += std::pow(steps.at(0.5 * h) - whole.value(0.5 * h), 2);
    }
    EXPECT_NEAR(xx / kPixels, s2, kTolerance * s2) << t1_ms;
    const double expected = 2 * (s2 - expected_covariance(noise, lag));
    EXPECT_NEAR(difference2 / kPixels, expected, 1.5 * kTolerance * expected) << t1_ms;
    // What the ends do not tell is not lost.
    EXPECT_GT(std::sqrt(residual2 / kPixels), 0.03 * noise.deviation(0)) << t1_ms;
  }
}

TEST(PhotoreceptorNoise, BoundsOfPartsContainItsValues) {
  for (const auto& [t1_ms, t2_ms] : kTimeConstants_ms) {
    const PhotoreceptorNoise noise = make_noise(t1_ms, t2_ms);
    const double h = noise.step_ns(0);
    int outside = 0;
    for (std::uint32_t i = 0; i < 4000; ++i) {
      const Steps steps(noise, i);
      const auto [low, high] = noise.bounds(steps.from, steps.to, 0);
      for (double tau = 0.01 * h; tau < h; tau += 0.045 * h) {
        const double x = steps.at(tau);
        outside += x < low || x > high ? 1 : 0;
      }
    }
    EXPECT_LE(outside, 8) << t1_ms;  // of 88,000
  }
}

TEST(PhotoreceptorNoise, GapsKeepTheVarianceAndTheMemoryOfTheCircuit) {
  const PhotoreceptorNoise noise = make_noise();
  const double s2 = noise.deviation(0) * noise.deviation(0);
  for (const double gap : {1e-4 * kMs, 0.5 * kMs, 20 * kMs}) {
    double xx = 0, yy = 0, lagged = 0;
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      PhotoreceptorNoise::Draws draws;
      const std::uint32_t node = 2;
      noise.draw(1, &i, &node, draws);
      const NoiseState before = noise.first(i, 0);
      const NoiseState after = noise.after_gap(before, {draws[0][0][0], draws[0][1][0]}, gap, 0);
      xx += after.x * after.x, yy += after.y * after.y, lagged += before.x * after.x;
    }
    EXPECT_NEAR(xx / kPixels, s2, kTolerance * s2) << gap;
    EXPECT_NEAR(yy / kPixels, 1.0, kTolerance) << gap;
    EXPECT_NEAR(lagged / kPixels, expected_covariance(noise, gap), kTolerance * s2) << gap;
  }
}

TEST(PhotoreceptorNoise, DrawsDoNotDependOnTheOthersDrawnWithThem) {
  const PhotoreceptorNoise noise = make_noise();
  const std::array<std::uint32_t, 4> pixels{7, 3, 7, 900}, first{10, 12, 12, 0};
  PhotoreceptorNoise::Draws together, alone;
  noise.draw(4, pixels.data(), first.data(), together);
  for (std::size_t i = 0; i < 4; ++i) {
    noise.draw(1, &pixels[i], &first[i], alone);
    for (std::size_t k = 0; k < PhotoreceptorNoise::kNodesDrawn; ++k) {
      for (const std::size_t j : {0, 1}) EXPECT_EQ(together[k][j][i], alone[k][j][0]);
    }
  }
  EXPECT_NE(together[0][0][2], together[0][0][0]);  // nodes 12 and 10 of pixel 7
  EXPECT_NE(together[1][0][0], together[0][0][0]);
}

TEST(PhotoreceptorNoise, RefusesTimeConstantsThatCannotBe) {
  const AddressedRandom random(1, Purpose::test);
  EXPECT_THROW(PhotoreceptorNoise(0, 1, 1, 1, random), UserError);
  EXPECT_THROW(PhotoreceptorNoise(1, 0, 1, 1, random), UserError);
  EXPECT_THROW(PhotoreceptorNoise(1, 1, 0, 1, random), UserError);
  EXPECT_THROW(PhotoreceptorNoise(1, 1, 2, 1, random), UserError);
}

}  // namespace
}  // namespace esim
