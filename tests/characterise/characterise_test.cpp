// The parameters of simulated pixels, measured on the bench.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "esim/characterise/rates.h"
#include "esim/characterise/response.h"
#include "esim/characterise/threshold_fit.h"
#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr double kElementaryCharge_fC = 1.602176634e-4;

/// A sensor whose response to a step is over before its refractory period ends. 10 fA per lux.
EventCameraOptions slow_to_fire() {
  EventCameraOptions options;
  options.contrast_threshold = 0.25;
  options.refractory_period_us = 60'000;
  options.circuit = CircuitOptions{};
  options.circuit->dark_current_fa = 10;
  options.circuit->photodiode_charge_e = 600;
  options.circuit->source_follower_hz = 200;
  return options;
}

ResponseTimes times_of(const EventCameraOptions& options) {
  const CircuitOptions& circuit = *options.circuit;
  return {circuit.photodiode_charge_e * kElementaryCharge_fC / circuit.photocurrent_fa_per_lux,
          1 / (2 * std::numbers::pi * circuit.source_follower_hz),
          circuit.dark_current_fa / circuit.photocurrent_fa_per_lux};
}

TrialProtocol steps_for(const EventCameraOptions& options, double lux, std::vector<double> contrasts, int repeats) {
  return TrialProtocol::steps(lux, std::move(contrasts), repeats, times_of(options).sum_s(lux),
                              1e-6 * options.refractory_period_us);
}

std::vector<double> around(double centre, double reach, int count = 9) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(centre * (1 + reach * (2.0 * i / (count - 1) - 1)));
  return values;
}

TEST(Bench, SCurvesReturnThresholdMismatchAndNoise) {
  EventCameraOptions options = slow_to_fire();
  options.threshold_mismatch = 0.02;
  for (const double sign : {1.0, -1.0}) {
    const double lux = 5;
    const SensorUnderTest sensor = simulated_sensor(options, 16, 16, 1);
    const TrialCounts counts = measure(sensor, steps_for(options, lux, around(sign * 0.2, 0.6), 16));
    const PixelEstimate estimate = fit_steps(std::vector{counts}, times_of(options));
    const double noise = std::sqrt(1 / (600 * (1 + times_of(options).t2_s / times_of(options).t1_s(lux))));
    EXPECT_LT(fit_cumulative_normal(counts).centre, 0.23);  // noise moves it below the threshold
    EXPECT_NEAR(estimate.threshold / 0.25, 1, 0.02);
    EXPECT_NEAR(estimate.noise(lux) / noise, 1, 0.02);
    EXPECT_NEAR(estimate.mismatch / 0.02, 1, 0.1);
  }
}

TEST(Bench, SCurvesAtTwoLightLevelsReturnTheDarkCurrent) {
  EventCameraOptions options = slow_to_fire();
  options.threshold_mismatch = 0.02;
  const SensorUnderTest sensor = simulated_sensor(options, 48, 32, 2);
  const ResponseTimes truth = times_of(options);
  std::vector<TrialCounts> recordings;
  for (const double lux : {20.0, 0.3}) {
    const double contrast = std::log1p(std::expm1(lux > 1 ? 0.22 : 0.18) * (1 + truth.dark_lux / lux));
    recordings.push_back(measure(sensor, steps_for(options, lux, around(contrast, 0.6), 12)));
  }
  ResponseTimes times = truth;
  times.dark_lux = 0;
  const PixelEstimate estimate = fit_steps(recordings, times, {.dark_current = true});
  EXPECT_NEAR(estimate.times.dark_lux / truth.dark_lux, 1, 0.02);
  EXPECT_NEAR(estimate.threshold / 0.25, 1, 0.02);
  EXPECT_NEAR(estimate.noise(0.3) / std::sqrt(1 / (600 * (1 + truth.t2_s / truth.t1_s(0.3)))), 1, 0.02);
}

TEST(Bench, LatencyFollowsTheCircuitInAnyLight) {
  EventCameraOptions options = slow_to_fire();
  options.circuit->noise = 0;
  options.threshold_mismatch = 0.005;
  const ResponseTimes truth = times_of(options);
  const SensorUnderTest sensor = simulated_sensor(options, 16, 16, 3);
  std::vector<LatencyPoint> points;
  for (const double lux : {0.5, 3.0, 20.0, 100.0, 1000.0}) {
    const double contrast = 1, effective = truth.effective(contrast, lux);
    const double measured = measure(sensor, steps_for(options, lux, {contrast}, 1)).median_latency_s(0);
    const double expected = step_latency_s(effective, 0.25, truth.t1_s(lux * std::exp(contrast)), truth.t2_s);
    EXPECT_NEAR(measured / expected, 1, 0.02) << lux;
    points.push_back({lux, measured});
  }
  const ResponseTimes times = fit_latencies(points, 1, 0.25, truth.dark_lux);
  EXPECT_NEAR(times.t1_lux_s / truth.t1_lux_s, 1, 0.02);
  EXPECT_NEAR(times.t2_s / truth.t2_s, 1, 0.02);
}

TEST(Bench, BandwidthFollowsTheCircuitInAnyLight) {
  EventCameraOptions options = slow_to_fire();
  options.circuit->noise = 0;
  options.contrast_threshold = 0.06;
  options.threshold_mismatch = 0.002;
  const ResponseTimes truth = times_of(options);
  const SensorUnderTest sensor = simulated_sensor(options, 16, 8, 4);
  for (const double lux : {5.0, 20.0}) {
    const double expected = truth.bandwidth_hz(lux);
    std::vector<double> frequencies;
    for (const double factor : {0.25, 0.7, 1.4, 2.5}) frequencies.push_back(factor * expected);
    const Bandwidth bandwidth = measure_bandwidth(sensor, steps_for(options, lux, {1}, 1), frequencies, 0.06);
    EXPECT_NEAR(bandwidth.bandwidth_hz / expected, 1, 0.02) << lux;
    EXPECT_NEAR(bandwidth.threshold / (0.06 * (1 + truth.dark_lux / lux)), 1, 0.02) << lux;
  }
}

TEST(Bench, NoiseAlternatesInTheDark) {
  EventCameraOptions options = slow_to_fire();
  options.contrast_threshold = 0.13;
  options.refractory_period_us = 1000;
  const NoiseRates dark = measure_noise(simulated_sensor(options, 16, 16, 5), 0, 1, 10);
  EXPECT_GT(dark.alternating, 0.9);
}

TEST(Bench, LeakIsWhatRemainsInLight) {
  EventCameraOptions options = slow_to_fire();
  options.leak_rate_hz = 0.5;
  options.refractory_period_us = 1000;
  const NoiseRates rates = measure_noise(simulated_sensor(options, 16, 16, 6), 5000, 1, 20);
  EXPECT_NEAR(rates.leak_hz() / 0.5, 1, 0.02);
}

TEST(Bench, RampsReturnTheRefractoryPeriod) {
  EventCameraOptions options = slow_to_fire();
  options.refractory_period_us = 1500;
  options.circuit->noise = 0;
  options.circuit->source_follower_hz = 5000;
  const Refractory refractory =
      measure_refractory(simulated_sensor(options, 16, 16, 7), 200, 8, std::vector{100.0, 200.0, 400.0}, 0.1);
  EXPECT_NEAR(refractory.period_s / 1.5e-3, 1, 0.02);
  EXPECT_NEAR(refractory.threshold / 0.25, 1, 0.02);
}

}  // namespace
}  // namespace esim
