// Circuits that are known are found again from lamps and from noise; what recordings do not determine says why.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "esim/fit/circuit/circuit_model.h"
#include "fit/circuits.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kSmall = 24;  // px

const Estimate& estimate(const CircuitFit& fit, const std::string& name) {
  for (const Estimate& e : fit.estimates) {
    if (e.name == name) return e;
  }
  throw std::runtime_error("no estimate of " + name);
}

/// Within twice the interval, so that one test in 10,000 fails by chance, and the interval is narrower than `widest`,
/// as a logarithm.
void expect_near(const CircuitFit& fit, const std::string& name, double truth, double widest = 0.3) {
  const Estimate& e = estimate(fit, name);
  ASSERT_TRUE(e.determined()) << name << ": " << e.reason;
  EXPECT_LT(std::abs(std::log(e.value / truth)), std::log(e.high / e.low)) << name << ": " << e.value << ", " << truth;
  EXPECT_LT(std::log(e.high / e.low), widest) << name;
}

TEST(FitCircuit, FindsThresholdsAndTimeConstantsFromLamps) {
  const EventCameraOptions truth = test::random_circuit(1, test::kLampNoise);
  const CircuitFit found = test::fit_lamps(truth, test::record_lamps(truth, 1, kSmall));
  expect_near(found, "contrast_threshold_on", truth.threshold_on());
  expect_near(found, "contrast_threshold_off", truth.threshold_off());
  expect_near(found, "circuit.photocurrent_fa_per_lux", truth.circuit->photocurrent_fa_per_lux);
  expect_near(found, "circuit.source_follower_hz", truth.circuit->source_follower_hz);
  EXPECT_EQ(found.observations.size(), 4);  // latency and bandwidth in two lights
  EXPECT_TRUE(test::contains(estimate(found, "circuit.photodiode_charge_e").reason, "no recording in constant light"));
}

TEST(FitCircuit, FindsNoise) {
  const EventCameraOptions truth = test::random_circuit(1, test::kMuchNoise);
  const CircuitFit found = test::fit_noise(truth, test::record_noise(truth, 1, kSmall));
  expect_near(found, "circuit.photodiode_charge_e", truth.circuit->photodiode_charge_e);
  expect_near(found, "circuit.dark_current_fa", truth.circuit->dark_current_fa, 0.5);
  EXPECT_TRUE(test::contains(estimate(found, "contrast_threshold_on").reason, "no recording of a flickering lamp"));
}

/// A lamp that makes `per_period` ON and OFF events of each pixel, and whose frequency is said to be `stated_hz`.
PixelCounts lamp(const KnownLight& light, std::uint32_t per_period, double duration_s = 1,
                 std::optional<double> stated_hz = {}, int side = kSmall) {
  PixelCounter counter({light.lux, stated_hz.value_or(light.frequency_hz), light.modulation}, side, side);
  std::vector<Event> events;
  for (int period = 0; period < duration_s * light.frequency_hz; ++period) {
    for (std::uint32_t k = 0; k < 2 * per_period; ++k) {
      for (std::uint16_t y = 0; y < side; ++y) {
        for (std::uint16_t x = 0; x < side; ++x) {
          const double phase = period + 0.9 * k / (2.0 * per_period);
          events.push_back(
              {to_ns(phase / light.frequency_hz), x, y, static_cast<std::int8_t>(k < per_period ? 1 : -1)});
        }
      }
    }
  }
  counter.add(events);
  return counter.finish(duration_s);
}

std::string reason(const std::vector<PixelCounts>& recordings, EventCameraOptions base, const std::string& name) {
  const CircuitFit found = fit_circuit({std::move(base), recordings});
  for (const Estimate& e : found.estimates) EXPECT_FALSE(e.determined()) << e.name;
  return estimate(found, name).reason;
}

TEST(FitCircuit, LampsThatDetermineNothingSayWhy) {
  const EventCameraOptions base = test::random_circuit(1, test::kLampNoise);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const PixelCounts usual = lamp({100, 20, 0.5}, 3);
  const char* const on = "contrast_threshold_on";
  EXPECT_TRUE(test::contains(reason({}, base, on), "no recording of a flickering lamp"));
  EXPECT_TRUE(test::contains(reason({usual}, EventCameraOptions{}, on), "no circuit"));
  EXPECT_TRUE(test::contains(reason({usual}, base, on), "two frequencies"));
  const CircuitFit one_unknown = fit_circuit({base, {usual, lamp({kNone, 40, 0.5}, 3)}});
  ASSERT_EQ(one_unknown.notes.size(), 1);
  EXPECT_TRUE(test::contains(one_unknown.notes[0], "not used: 40 Hz at ? lux: the illuminance is unknown"));
  EXPECT_TRUE(test::contains(reason({usual, lamp({kNone, 40, 0.5}, 3)}, base, on), "illuminance is unknown"));
  EXPECT_TRUE(
      test::contains(reason({usual, lamp({100, 40, kNone}, 3)}, base, on), "modulation of the lamp is unknown"));
  EXPECT_TRUE(test::contains(reason({usual, lamp({100, 40, 0.5}, 3, 0.1)}, base, on), "in 3 periods"));

  // Another frequency than the lamp's, and a filter that drops one polarity.
  PixelCounter other({100, 33.3, 0.5}, kSmall, kSmall), filtered({100, 20, 0.5}, kSmall, kSmall);
  std::vector<Event> events;
  for (int k = 0; k < 4000; ++k)
    events.push_back(
        {to_ns(1e-3 * k), static_cast<std::uint16_t>(k % kSmall), 3, static_cast<std::int8_t>(k % 2 ? 1 : -1)});
  other.add(events);
  for (Event& event : events) event.polarity = 1;
  filtered.add(events);
  EXPECT_TRUE(test::contains(reason({usual, other.finish(4)}, base, on), "do not follow a lamp of 33.3 Hz"));
  EXPECT_TRUE(test::contains(reason({usual, filtered.finish(4)}, base, on), "filters of the camera"));

  // Frequencies that are not the lamp's: it is 40 Hz.
  const auto stated = [&](double hz) { return reason({usual, lamp({100, 40, 0.5}, 2, 1, hz)}, base, on); };
  EXPECT_TRUE(test::contains(stated(20), "do not follow a lamp of 20 Hz"));
  EXPECT_TRUE(test::contains(stated(60), "do not follow a lamp of 60 Hz"));
  EXPECT_TRUE(test::contains(stated(80), "repeat 40 times per second, or less often, not 80 times"));
  EXPECT_TRUE(test::contains(stated(120), "repeat 40 times per second, or less often, not 120 times"));

  // Pixels that hardly follow the lamp.
  PixelCounts few = lamp({100, 40, 0.5}, 1);
  few.extent *= 2;
  EXPECT_TRUE(test::contains(reason({usual, few}, base, on), "make 0.5 events of a polarity in a period"));

  // More events than the readout can read.
  EventCameraOptions slow = base;
  slow.readout.rate_mev_per_s = 0.1;
  EXPECT_TRUE(test::contains(reason({usual, lamp({100, 40, 0.5}, 3)}, slow, on), "region of interest"));
  // Pixels that are mostly in their refractory period.
  slow = base;
  slow.refractory_period_us = 3000;
  EXPECT_TRUE(test::contains(reason({usual, lamp({100, 40, 0.5}, 3)}, slow, on), "refractory period of 3000 us"));
}

TEST(FitCircuit, FewPointsOfALampGiveTheNumbersOfMany) {
  const EventCameraOptions sensor = test::random_circuit(1, test::kLampNoise);
  const auto events = [&](int points) {
    const PixelCounts counts = simulate_counts(sensor, {300, 50, 0.6}, 8, 8, kSmall, 1, points);
    double sum = 0;
    for (const PixelCounts::Pixel& p : counts.pixels.pixels()) sum += p.on + p.off;
    return sum;
  };
  EXPECT_NEAR(events(16) / events(256), 1, 5e-3);  // the fundamental of 16 points is smaller by 1.3 %
}

TEST(FitCircuit, ApproximateNumbersAreNearThoseOfTheCircuit) {
  using enum CircuitModel::Index;
  for (const std::uint32_t number : {1U, 2U, 3U}) {
    const EventCameraOptions truth = test::random_circuit(number, test::kLampNoise);
    const std::vector<PixelCounts> recordings = test::record_lamps(truth, 1, 24);  // so that chance hardly matters
    const CountMoments recorded = count_moments(recordings, std::vector<bool>(576, true));
    const CircuitModel model(truth, {kFollower}, recordings, recorded.mean);
    const Eigen::VectorXd found =
        model.approximate(Eigen::VectorXd::Constant(1, std::log(truth.circuit->source_follower_hz)));
    for (Eigen::Index k = 0; k < found.size(); ++k) {
      if (recorded.mean[k] < 1.1) continue;  // over a range of lamps, pixels make one event in each period
      EXPECT_NEAR(found[k], recorded.mean[k], 0.1 * recorded.mean[k] + 0.15) << number << ", " << k;
    }
  }
}

TEST(FitCircuit, NumbersOfNoSensorDetermineNothing) {
  EventCameraOptions base = test::random_circuit(1, test::kLampNoise);
  base.refractory_period_us = 20;
  const auto few_pixels = [](const KnownLight& light, std::uint32_t per_period) {
    return lamp(light, per_period, 0.2, {}, 12);  // each of which makes as many events
  };
  // More events at the higher frequency.
  EXPECT_TRUE(test::contains(
      reason({few_pixels({100, 100, 0.5}, 1), few_pixels({10, 100, 0.5}, 4), few_pixels({100, 1000, 0.5}, 5)}, base,
             "contrast_threshold_on"),
      "no sensor of this kind"));
}

TEST(FitCircuit, OneLightLevelDoesNotTellTheTimeConstantsApart) {
  const EventCameraOptions truth = test::random_circuit(1, test::kLampNoise);
  std::vector<PixelCounts> recordings = test::record_lamps(truth, 2, kSmall);
  recordings.resize(2);
  const CircuitFit found = test::fit_lamps(truth, recordings);
  EXPECT_TRUE(test::contains(estimate(found, "circuit.photocurrent_fa_per_lux").reason, "one light level"));
  EXPECT_TRUE(test::contains(estimate(found, "circuit.source_follower_hz").reason, "one light level"));
  // The thresholds depend on how the time constants share the latency: their intervals are wide, if the search ends.
  const Estimate& on = estimate(found, "contrast_threshold_on");
  if (on.determined()) {
    expect_near(found, "contrast_threshold_on", truth.threshold_on(), 1.4);
  } else {
    EXPECT_TRUE(test::contains(on.reason, "add a lamp at another frequency and illuminance"));
  }
}

TEST(FitCircuit, NoiseThatDeterminesNothingSaysWhy) {
  const EventCameraOptions base = test::random_circuit(1, test::kMuchNoise);
  const char* const charge = "circuit.photodiode_charge_e";
  EXPECT_TRUE(test::contains(reason({}, base, charge), "no recording in constant light of known illuminance"));
  PixelCounter quiet({1, 0, 0}, kSmall, kSmall);
  EXPECT_TRUE(test::contains(reason({quiet.finish(10)}, base, charge), "0 OFF events"));
  EventCameraOptions noiseless = base;
  noiseless.circuit->noise = 0;
  const PixelCounts noise = simulate_counts(base, {0.2, 0, 0}, 1, 1, kSmall, 1);
  EXPECT_TRUE(test::contains(reason({noise}, noiseless, charge), "noise of the base is 0"));
  const CircuitFit one = test::fit_noise(base, {noise});
  EXPECT_TRUE(
      test::contains(estimate(one, "circuit.source_follower_hz").reason, "1 different illuminance; 2 are necessary"));
  EXPECT_TRUE(test::contains(estimate(one, "circuit.dark_current_fa").reason, "3 are necessary"));
}

}  // namespace
}  // namespace esim
