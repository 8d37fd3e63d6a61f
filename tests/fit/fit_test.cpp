// Sensors that are known are found again; what recordings do not determine says why.
#include <gtest/gtest.h>

#include <cmath>

#include "esim/core/error.h"
#include "esim/fit/jackknife.h"
#include "fit/known_sensors.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::kSide;

TEST(Fit, FindsKnownSensors) {  // tests/long/fit_test.cpp: of 200 sensors
  int inside = 0, all = 0;
  const auto coverage = test::fit_random_sensors(3);
  for (const test::Coverage& c : coverage) inside += c.inside, all += c.sensors;
  EXPECT_GE(inside, all - 4);  // 21 intervals, of which 1.05 do not contain the truth on average; 0.3 % by chance
  for (const std::size_t i : {0U, 1U}) EXPECT_LT(coverage[i].worst, 0.01) << coverage[i].name;
  EXPECT_LT(coverage[2].worst, 0.1);
  EXPECT_LT(coverage[3].worst, 0.002);
  EXPECT_LT(coverage[4].worst, 0.05);
}

TEST(Fit, SeparatesWhatBothThresholdsOfAPixelShare) {
  EventCameraOptions sensor;
  sensor.contrast_threshold = 0.2;
  sensor.threshold_mismatch = 0.004;
  sensor.circuit = CircuitOptions{};
  sensor.circuit->noise = 0, sensor.circuit->threshold_mismatch_common = 0.05;
  sensor.circuit->source_follower_hz = 1e5, sensor.circuit->photocurrent_fa_per_lux = 1e4;
  const auto found = test::fit_waves(sensor, 0, 3, 1);
  EXPECT_NEAR(found.on.value, 0.2, 0.002);
  EXPECT_NEAR(found.common.value, 0.05, 0.003);
  EXPECT_NEAR(found.mismatch.value, 0.004, 0.0008);
}

TEST(Fit, FindsTheOffsetOfTheLogarithm) {
  EventCameraOptions sensor;
  sensor.contrast_threshold = 0.2;
  sensor.log_eps = 0.02;
  EventCamera camera(sensor, kSide, kSide, 1);
  ContrastFit contrast(kSide, kSide, {0, 0.015, true});
  const Workers workers(1);
  std::vector<Event> events;
  for (int k = 0; k <= 1500; ++k) {
    const Image<float> image = test::waves(k * 2e-3);
    camera.process(image, to_ns(k * 2e-3), events, workers);
    contrast.add(to_ns(k * 2e-3), image, events);
    events.clear();
  }
  const auto found = contrast.finish();
  EXPECT_NEAR(found.offset.value, 0.02, 0.001);
  EXPECT_NEAR(found.on.value, 0.2, 0.002);
}

TEST(Fit, FindsDeadPixels) {
  EventCameraOptions sensor;
  sensor.contrast_threshold = 0.2;
  sensor.dead_pixels = 0.02;
  const auto found = test::fit_waves(sensor, 0, 2, 1);
  ASSERT_TRUE(found.dead.determined()) << found.dead.reason;
  EXPECT_LE(found.dead.low, 0.02);
  EXPECT_GE(found.dead.high, 0.02);
}

TEST(Fit, FindsLeakAmongNoise) {
  EventCameraOptions sensor;
  sensor.contrast_threshold = 0.25;
  sensor.threshold_ratio = 1.2;
  sensor.leak_rate_hz = 0.3;
  sensor.circuit = CircuitOptions{};
  sensor.circuit->photocurrent_fa_per_lux = 0.05, sensor.circuit->photodiode_charge_e = 140;
  BackgroundFit background(kSide, kSide);
  background.add(test::constant_light(sensor, 0.5F, 12, 1));
  const auto found = background.finish(12, 1.2);
  EXPECT_GT(found.off_hz, 0.1);  // there is noise
  EXPECT_NEAR(found.leak_rate.value, 0.3, 0.03);
}

TEST(Fit, RefusesToInvent) {
  const std::vector<Event> none;
  BackgroundFit background(kSide, kSide);
  background.add(none);
  const auto dark = background.finish(10, 1);
  EXPECT_TRUE(test::contains(dark.leak_rate.reason, "0 ON events")) << dark.leak_rate.reason;
  EXPECT_TRUE(test::contains(dark.hot_rate.reason, "hot pixels"));

  ShortestIntervals intervals(kSide, kSide);
  EXPECT_TRUE(test::contains(intervals.finish(1).refractory.reason, "0 pairs"));

  // Intervals of which ever more are ever longer, as of smooth changes of light.
  std::vector<Event> events;
  for (int k = 0; k < 2000; ++k) {
    const auto x = static_cast<std::uint16_t>(k % kSide), y = static_cast<std::uint16_t>(k / kSide);
    events.push_back({to_ns(k), x, y, 1});
    events.push_back({to_ns(k + 1e-3 + 1e-4 * std::sqrt(k)), x, y, 1});
  }
  intervals.add(events);
  EXPECT_TRUE(test::contains(intervals.finish(1).refractory.reason, "upper limit"));

  ContrastFit still(kSide, kSide, {});
  const Image<float> grey(kSide, kSide, 0.5F);
  still.add(0, grey, none);
  still.add(1000, grey, none);
  EXPECT_TRUE(test::contains(still.finish().on.reason, "moves"));

  // Events of another scene than the images.
  EventCameraOptions sensor;
  EventCamera camera(sensor, kSide, kSide, 1);
  ContrastFit other(kSide, kSide, {});
  const Workers workers(1);
  for (int k = 0; k <= 2000; ++k) {
    events.clear();
    camera.process(test::waves(k * 1e-3), to_ns(k * 1e-3), events, workers);
    other.add(to_ns(k * 1e-3), test::waves(100 - 3.7e-3 * k), events);
  }
  const auto wrong = other.finish();
  EXPECT_TRUE(test::contains(wrong.on.reason, "same motion")) << wrong.on.value << " " << wrong.on.reason;
}

TEST(Fit, TimesMayBeNegative) {
  EventCameraOptions leaking, noisy;
  leaking.leak_rate_hz = 0.3, leaking.leak_mismatch_decades = 0.2;
  noisy.shot_noise_hz = 20, noisy.refractory_period_us = 200;
  const auto fit = [&](double shift_s) {
    std::vector<Event> leak = test::constant_light(leaking, 0.5F, 12, 1),
                       noise = test::constant_light(noisy, 0.5F, 12, 1);
    for (Event& event : leak) event.t += to_ns(shift_s);
    for (Event& event : noise) event.t += to_ns(shift_s);
    BackgroundFit regular(kSide, kSide), random(kSide, kSide);
    regular.add(leak), random.add(noise);
    ShortestIntervals intervals(kSide, kSide);
    intervals.add(noise);
    const auto a = regular.finish(12, 1), b = random.finish(12, 1);
    return std::array{a.leak_rate.value, a.leak_decades.value, b.leak_rate.high, intervals.finish(1).refractory.value};
  };
  EXPECT_EQ(fit(0), fit(-100));
}

TEST(Fit, WrongTimeStampsAreNoRates) {
  EventCameraOptions sensor;
  sensor.leak_rate_hz = 1;
  std::vector<Event> events = test::constant_light(sensor, 0.5F, 12, 1);
  for (Event& event : events) event.t = kNsPerSecond;  // a clock that stands still
  BackgroundFit background(kSide, kSide);
  background.add(events);
  const auto found = background.finish(12, 1);
  EXPECT_NEAR(found.leak_rate.value, 1, 0.05);
  EXPECT_FALSE(found.leak_jitter.determined());
  EXPECT_FALSE(found.leak_decades.determined() && found.leak_decades.value > 0.1);
}

TEST(Fit, FractionsHaveWilsonsInterval) {
  const Estimate some = fraction_estimate("dead_pixels", 10, 100, "");
  EXPECT_NEAR(some.low, 0.0552, 1e-4);
  EXPECT_NEAR(some.high, 0.1744, 1e-4);
  const Estimate none = fraction_estimate("dead_pixels", 0, 100, ""), all = fraction_estimate("dead_pixels", 7, 7, "");
  EXPECT_EQ(none.low, 0);
  EXPECT_NEAR(none.high, 0.0370, 1e-4);
  EXPECT_EQ(all.high, 1);
}

TEST(Fit, RefusesWrongImages) {
  ContrastFit fit(kSide, kSide, {});
  const auto add = [&](TimeNs t, int width, int height) {
    return test::message_of<UserError>([&] { fit.add(t, Image<float>(width, height, 1), {}); });
  };
  EXPECT_TRUE(test::contains(add(0, 3, 4), "3 x 4 px, but the sensor 64 x 64"));
  fit.add(5, Image<float>(kSide, kSide, 1), {});
  EXPECT_TRUE(test::contains(add(5, kSide, kSide), "not later"));
}

}  // namespace
}  // namespace esim
