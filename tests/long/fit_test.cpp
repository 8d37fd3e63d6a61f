// Whether the intervals of fitted parameters contain the truth as often as they say.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "fit/circuits.h"
#include "fit/known_sensors.h"

namespace esim {
namespace {

TEST(Fit, IntervalsContainTheTruth) {
  for (const test::Coverage& c : test::fit_random_sensors(200)) {
    std::printf("%-24s %d of %d, width %.2f, worst %.4f\n", c.name, c.inside, c.sensors, c.relative_width(), c.worst);
    EXPECT_GE(c.inside, 181) << c.name;  // binomial: 190 and 3 standard deviations of 3.1
    EXPECT_LE(c.inside, 199) << c.name;
    EXPECT_LE(c.relative_width(), 1.3) << c.name;
  }
}

/// Fits sensors, and prints how many of the first ones have intervals that contain the truth, and each one that does
/// not. A parameter that is not determined does not count.
template <typename Fit>
void expect_coverage(std::vector<test::Coverage> all, int sensors, const Fit& fit) {
  for (int i = 0; i < sensors; ++i) {
    fit(static_cast<std::uint32_t>(i), [&](const Estimate& e, const EventCameraOptions& truth) {
      for (test::Coverage& c : all) {
        if (e.name != c.name) continue;
        const double value = test::true_value(truth, e.name);
        if (e.determined()) {
          c.add(e, value);
          std::printf("sensor %d: %s: error %+.2f %%, half of the interval %.2f %%\n", i, c.name,
                      100 * (e.value / value - 1), 50 * (e.high - e.low) / value);
        }
        if (!e.determined())
          std::printf("sensor %d: %s: %s\n", i, c.name, e.reason.c_str());
        else if (value < e.low || value > e.high)
          std::printf("sensor %d: %s: %.5g is not within %.5g (%.5g to %.5g)\n", i, c.name, value, e.value, e.low,
                      e.high);
      }
    });
    std::printf("after %d sensors\n", i + 1);
    for (const test::Coverage& c : all)
      std::printf("  %-32s %d of %d, width %.2f, stated over found %.2f, worst %.4f\n", c.name, c.inside, c.sensors,
                  c.relative_width(), c.stated_over_found(), c.worst);
    std::fflush(stdout);
  }
  for (const test::Coverage& c : all) {
    EXPECT_GE(c.sensors, sensors / 2) << c.name;
    // Binomial: 95 % and 3 standard deviations.
    EXPECT_GE(c.inside, 0.95 * c.sensors - 3 * std::sqrt(0.95 * 0.05 * c.sensors)) << c.name;
    EXPECT_LE(c.stated_over_found(), 2) << c.name;
  }
}

/// The environment may ask for another number.
int sensors_or(int usual) {
  const char* const asked = std::getenv("ESIM_FIT_SENSORS");
  return asked != nullptr ? std::stoi(asked) : usual;
}

TEST(Fit, IntervalsFromLampsContainTheTruth) {
  expect_coverage({{"contrast_threshold_on"},
                   {"contrast_threshold_off"},
                   {"circuit.photocurrent_fa_per_lux"},
                   {"circuit.source_follower_hz"}},
                  sensors_or(36), [](std::uint32_t i, const auto& add) {
                    const EventCameraOptions truth = test::random_circuit(i, test::kLampNoise);
                    for (const Estimate& e : test::fit_lamps(truth, test::record_lamps(truth, 1000000 + i)).estimates)
                      add(e, truth);
                  });
}

TEST(Fit, IntervalsFromNoiseContainTheTruth) {
  expect_coverage({{"circuit.photodiode_charge_e"}, {"circuit.dark_current_fa"}}, sensors_or(30),
                  [](std::uint32_t i, const auto& add) {
                    const EventCameraOptions truth = test::random_circuit(i, test::kMuchNoise);
                    for (const Estimate& e : test::fit_noise(truth, test::record_noise(truth, 1000000 + i)).estimates)
                      add(e, truth);
                  });
}

TEST(Fit, LampsOfAlmostOneLightLevelGiveNothingWrong) {
  const EventCameraOptions truth = test::random_circuit(1, test::kLampNoise);
  std::vector<PixelCounts> recordings;
  constexpr int kSide = 24;  // px
  for (const double lux : {100.0, 102.0}) {
    for (const double hz : {50.0, 300.0})
      recordings.push_back(simulate_counts(truth, {lux, hz, 0.6}, 16, 16, kSide, 1));
  }
  const CircuitFit found = test::fit_lamps(truth, recordings);
  for (const Estimate& e : found.estimates) {
    if (!e.name.starts_with("circuit.") || !e.determined()) continue;
    EXPECT_LT(std::abs(std::log(e.value / test::true_value(truth, e.name))), std::log(e.high / e.low)) << e.name;
  }
}

}  // namespace
}  // namespace esim
