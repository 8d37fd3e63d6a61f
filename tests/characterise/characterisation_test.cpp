// A whole characterisation of sensors that are known.
#include "esim/characterise/characterisation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "esim/characterise/response.h"
#include "support/errors.h"

namespace esim {
namespace {

/// 10 fA per lux, 10 fA dark current, almost no noise.
EventCameraOptions known_sensor() {
  EventCameraOptions options;
  options.contrast_threshold_on = 0.25;
  options.contrast_threshold_off = 0.3;
  options.threshold_mismatch = 0.02;
  options.refractory_period_us = 500;
  options.circuit = CircuitOptions{};
  options.circuit->dark_current_fa = 10;
  options.circuit->photodiode_charge_e = 600;
  options.circuit->source_follower_hz = 2000;
  options.circuit->noise = 0.02;
  return options;
}

CharacterisationOptions on_bench(std::vector<double> lux) {
  CharacterisationOptions options;
  options.lux = std::move(lux);
  options.width = options.height = 12;
  options.repeats = 4;
  options.noise_s = 2;
  options.sensor_width = 40, options.sensor_height = 30;
  return options;
}

TEST(Characterisation, ReturnsTheKnownSensor) {
  const Characterisation found = characterise_sensor("known", known_sensor(), on_bench({10, 1000}));
  const ResponseTimes truth{600 * 1.602176634e-4 / 10, 1 / (2 * std::numbers::pi * 2000), 1};
  ASSERT_EQ(found.levels.size(), 2U);
  for (const LightLevel& level : found.levels) {
    // The contrast of the light that makes a contrast of the photocurrents; its derivative for the mismatch.
    const double factor = 1 + 1 / level.lux;
    const double on = std::log1p(std::expm1(0.25) * factor), off = -std::log1p(std::expm1(-0.3) * factor);
    EXPECT_NEAR(level.on.threshold / on, 1, 0.02) << level.lux;
    EXPECT_NEAR(level.on_ramp.threshold / on, 1, 0.02) << level.lux;
    EXPECT_NEAR(level.off.threshold / off, 1, 0.02) << level.lux;
    EXPECT_NEAR(level.on.non_uniformity / 0.02, factor, 0.2);
    EXPECT_NEAR(level.off.non_uniformity / 0.02, factor, 0.2);
    const double effective = truth.effective(std::numbers::ln2, level.lux);
    EXPECT_NEAR(level.latency_s / step_latency_s(effective, 0.25, truth.t1_s(2 * level.lux), truth.t2_s), 1, 0.03);
    EXPECT_NEAR(level.bandwidth_hz / truth.bandwidth_hz(level.lux), 1, 0.05);
    EXPECT_LT(level.noise_on_hz + level.noise_off_hz, 0.01);
    EXPECT_TRUE(level.notes.empty()) << level.notes.front();
  }
  // ln((2 L + d) / (L + d)) = 0.25 with d = 1 lux
  EXPECT_NEAR(found.cutoff_lux / (std::expm1(0.25) / (2 - std::exp(0.25))), 1, 0.06);
  EXPECT_NEAR(found.dynamic_range_db(), 20 * std::log10(1e5 / found.cutoff_lux), 1e-9);
  EXPECT_NEAR(found.refractory_s / 500e-6, 1, 0.02);
  EXPECT_TRUE(found.notes.empty()) << found.notes.front();
  // After its first event, a pixel is held in reset until it has followed the edge: one event of each pixel.
  EXPECT_NEAR(found.peak_rate_hz / (1200 * 1e3), 1, 0.01);
}

TEST(Characterisation, OfPixelsWithoutCircuitUsesIrradiance) {
  EventCameraOptions options;
  options.contrast_threshold = 0.2;
  options.log_eps = 1e-6;
  const Characterisation found = characterise_sensor("ideal", options, on_bench({0.5}));
  EXPECT_FALSE(found.in_lux);
  EXPECT_NEAR(found.levels[0].on.threshold, 0.2, 0.005);
  EXPECT_NEAR(found.levels[0].off.threshold, 0.2, 0.005);
  EXPECT_LT(found.levels[0].on.non_uniformity, 0.005);
  EXPECT_TRUE(test::contains(describe({found}), "E = 0.5"));
}

TEST(Characterisation, SaysWhatItCannotMeasure) {
  EventCameraOptions options = known_sensor();
  options.contrast_threshold_on = 3;
  const Characterisation found = characterise_sensor("blind", options, on_bench({1}));
  EXPECT_TRUE(std::isnan(found.levels[0].on.threshold));
  EXPECT_TRUE(std::isnan(found.levels[0].latency_s) || std::isinf(found.levels[0].latency_s));
  const std::string text = describe({found});
  EXPECT_TRUE(test::contains(text, "S-curve, ON, at 1 lux: the threshold is beyond"));
  EXPECT_TRUE(test::contains(text, "latency at 1 lux: fewer than half"));
  EXPECT_TRUE(test::contains(text, "cutoff: "));
  EXPECT_TRUE(test::contains(to_json({found}), "\"threshold\": null"));
}

}  // namespace
}  // namespace esim
