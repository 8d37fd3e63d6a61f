// Options of pixels by their circuit: values that are refused, the estimate of the noise, the maximum rate, time
// stamps.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/event_camera/event_camera.h"
#include "esim/event_camera/noise_rate.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kWidth = 24, kHeight = 16;

struct Outcome {
  std::vector<Event> events;
  EventCameraStatistics statistics;
};

/// Events of a uniform field with irradiance(t_s).
Outcome run(const EventCameraOptions& options, const std::function<double(double)>& irradiance, double rate_hz,
            double duration_s, int threads = 1) {
  EventCamera camera(options, kWidth, kHeight, 5);
  const Workers workers(threads);
  Outcome out;
  Image<float> image(kWidth, kHeight);
  for (int k = 0; k <= std::lround(duration_s * rate_hz); ++k) {
    const double t_s = k / rate_hz;
    std::fill(image.data(), image.data() + image.size(), static_cast<float>(irradiance(t_s)));
    camera.process(image, std::llround(1e9 * t_s), out.events, workers);
  }
  out.statistics = camera.statistics();
  return out;
}

double events_per_pixel(const Outcome& done) { return static_cast<double>(done.events.size()) / (kWidth * kHeight); }

EventCameraOptions circuit(double threshold) {
  EventCameraOptions options;
  options.contrast_threshold = threshold;
  options.circuit.emplace();
  return options;
}

TEST(CircuitOptions, ValuesOutOfRangeAreRefusedByName) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  struct Case {
    const char* name;
    std::function<void(EventCameraOptions&)> spoil;
  };
  const std::vector<Case> cases = {
      {"circuit.white_lux", [](auto& o) { o.circuit->white_lux = -1; }},
      {"circuit.white_lux", [&](auto& o) { o.circuit->white_lux = kNan; }},
      {"circuit.f_number", [](auto& o) { o.circuit->f_number = 0; }},
      {"circuit.transmission", [](auto& o) { o.circuit->transmission = 2; }},
      {"circuit.photocurrent_fa_per_lux", [](auto& o) { o.circuit->photocurrent_fa_per_lux = 0; }},
      {"circuit.dark_current_fa", [](auto& o) { o.circuit->dark_current_fa = 0; }},
      {"circuit.photodiode_charge_e", [&](auto& o) { o.circuit->photodiode_charge_e = kInf; }},
      {"circuit.source_follower_hz", [](auto& o) { o.circuit->source_follower_hz = 0; }},
      {"circuit.noise", [](auto& o) { o.circuit->noise = -1; }},
      {"circuit.max_rate_hz", [&](auto& o) { o.circuit->max_rate_hz = kNan; }},
      {"readout.scan_period_us", [](auto& o) { o.readout.scan_period_us = -1; }},
      {"readout.time_stamp_us", [&](auto& o) { o.readout.time_stamp_us = kInf; }},
      {"readout.queue_events", [](auto& o) { o.readout.queue_events = 100; }},
  };
  EXPECT_NO_THROW(EventCamera(circuit(0.2), 4, 4));
  for (const Case& bad : cases) {
    EventCameraOptions options = circuit(0.2);
    bad.spoil(options);
    const std::string message = test::message_of<UserError>([&] { EventCamera(options, 4, 4); });
    EXPECT_TRUE(test::contains(message, std::string("event camera: ") + bad.name + " = ")) << message;
    EXPECT_FALSE(test::contains(message, "\n")) << message;
  }
}

TEST(CircuitOptions, ReadoutsOfCircuitsNeedOne) {
  EventCameraOptions options;
  options.readout.time_stamp_us = 1;
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { EventCamera(options, 4, 4); }),
                             "readout.time_stamp_us = 1 needs circuit"));
}

TEST(CircuitOptions, OptionsOfTheOlderModelNameTheOlderPreset) {
  EventCameraOptions options = preset_options("davis346");
  options.leak_jitter = 0.1;
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { EventCamera(options, 4, 4); }),
                             "leak_jitter = 0.1, but with circuit this follows from the circuit; remove it, or choose "
                             "preset davis346@1"));
}

TEST(CircuitOptions, TheNoiseRateIsThatOfTheCamera) {
  struct Case {
    double irradiance, threshold, refractory_us;
  };
  // Standard deviations: 0.041 in the dark, 0.015 at 0.5 (white at 1000 lux).
  for (const Case& c : {Case{0, 0.012, 1}, Case{0, 0.04, 300}, Case{0, 0.08, 300}, Case{0, 0.12, 300},
                        Case{0.01, 0.04, 300}, Case{0.01, 0.1, 300}, Case{0.5, 0.012, 300}, Case{0.5, 0.04, 300}}) {
    EventCameraOptions options = circuit(c.threshold);
    options.refractory_period_us = c.refractory_us;
    const auto light = [&](double) { return c.irradiance; };
    const double expected = noise_rate_hz(options, c.irradiance), seconds = c.irradiance > 0.1 ? 0.1 : 1;
    const double rate = events_per_pixel(run(options, light, 20, seconds)) / seconds;
    EXPECT_GT(rate, expected / 1.7) << c.irradiance << " " << c.threshold;
    EXPECT_LT(rate, expected * 1.7) << c.irradiance << " " << c.threshold;
  }
}

TEST(CircuitOptions, NoiseIsExcessiveIfItReachesTheThresholds) {
  EXPECT_FALSE(excessive_noise(EventCameraOptions{}));
  EXPECT_FALSE(excessive_noise(circuit(0.1)));
  EventCameraOptions noiseless = circuit(0.01);
  noiseless.circuit->noise = 0;
  EXPECT_FALSE(excessive_noise(noiseless));
  const auto noise = excessive_noise(circuit(0.01));
  ASSERT_TRUE(noise);
  EXPECT_EQ(noise->threshold, 0.01);
  EXPECT_NEAR(noise->deviation, 1 / std::sqrt(600.0), 0.001);
  EXPECT_GT(noise->rate_hz, noise_rate_hz(circuit(0.01), 0));
  for (const std::string& name : SensorPreset::names()) EXPECT_FALSE(excessive_noise(preset_options(name))) << name;
}

TEST(CircuitOptions, OnlyExcessiveNoiseWithoutOtherLimitsHasAUsualMaximumRate) {
  EXPECT_EQ(max_rate_hz(circuit(0.01)), 1e4);
  EXPECT_TRUE(std::isinf(max_rate_hz(circuit(0.2))));
  EventCameraOptions refractory = circuit(0.01), readout = circuit(0.01);
  refractory.refractory_period_us = 10;
  EXPECT_TRUE(std::isinf(max_rate_hz(refractory)));
  readout.readout.rate_mev_per_s = 10;
  EXPECT_TRUE(std::isinf(max_rate_hz(readout)));
  readout.circuit->max_rate_hz = 7;
  EXPECT_EQ(max_rate_hz(readout), 7);
}

TEST(CircuitOptions, AMaximumRateLimitsEveryPixelAndCountsWhatIsLost) {
  EventCameraOptions options = circuit(0.01);
  options.circuit->source_follower_hz = 1e6;
  options.circuit->max_rate_hz = 500;
  const auto bright = [](double) { return 1e4; };
  const Outcome one = run(options, bright, 50, 0.06), three = run(options, bright, 500, 0.06, 3);
  EXPECT_EQ(one.events, three.events);
  EXPECT_EQ(one.statistics.lost, three.statistics.lost);
  std::map<std::pair<int, int>, TimeNs> last;
  for (const Event& e : one.events) {
    const auto found = last.find({e.x, e.y});
    if (found != last.end()) {
      EXPECT_GE(e.t - found->second, 2 * kNsPerMs - 1);
    }
    last[{e.x, e.y}] = e.t;
  }

  // A ramp without noise crosses 100 levels per second; all others are lost.
  EventCameraOptions ramp = circuit(0.01);
  ramp.circuit->noise = 0;
  ramp.circuit->dark_current_fa = 1e-9;
  ramp.circuit->max_rate_hz = 20;
  const auto rising = [](double t) { return 0.3 * std::exp(t); };
  const Outcome limited = run(ramp, rising, 100, 1);
  EXPECT_NEAR(events_per_pixel(limited), 20, 4);
  const double crossed = events_per_pixel(limited) + static_cast<double>(limited.statistics.lost) / (kWidth * kHeight);
  EXPECT_GT(crossed, 75);  // what remains of a threshold is lost too, once per event
  EXPECT_LT(crossed, 101);
  ramp.circuit->max_rate_hz = 0;
  const Outcome free = run(ramp, rising, 100, 1);
  EXPECT_NEAR(events_per_pixel(free), 99.5, 1);
  EXPECT_EQ(free.statistics.lost, 0);
}

TEST(CircuitOptions, LostEventsBelongToTheSavedState) {
  EventCameraOptions options = circuit(0.01);
  options.circuit->max_rate_hz = 100;
  const Workers workers(1);
  EventCamera camera(options, kWidth, kHeight), other(options, kWidth, kHeight);
  std::vector<Event> events;
  for (int k = 0; k < 20; ++k) camera.process(Image<float>(kWidth, kHeight, 0.1F), k * 10 * kNsPerMs, events, workers);
  ASSERT_GT(camera.statistics().lost, 0);
  other.restore(camera.state());
  EXPECT_EQ(other.statistics().lost, camera.statistics().lost);
}

TEST(CircuitOptions, TimeStampsAreMultiplesOfTheirUnit) {
  EventCameraOptions options = circuit(0.05), fine = options;
  options.readout = {.rate_mev_per_s = 20, .time_stamp_us = 1};
  fine.readout = {.rate_mev_per_s = 20};
  const auto light = [](double t) { return 0.3 + 0.2 * std::sin(40 * t); };
  const Outcome coarse = run(options, light, 100, 0.06);
  ASSERT_GT(coarse.events.size(), 2000U);
  EXPECT_TRUE(std::is_sorted(coarse.events.begin(), coarse.events.end()));
  std::multimap<std::pair<int, int>, TimeNs> times;
  for (const Event& e : run(fine, light, 100, 0.06).events) times.emplace(std::pair{e.x, e.y}, e.t);
  std::map<std::pair<int, int>, int> counted;
  for (const Event& e : coarse.events) {
    ASSERT_EQ(e.t % kNsPerUs, 0);
    const auto found = std::next(times.find({e.x, e.y}), counted[{e.x, e.y}]++);
    ASSERT_TRUE(found != times.end());
    ASSERT_EQ(e.t, (found->second + 999) / 1000 * 1000);  // the pixels do not wait for the stamp
  }
}

TEST(CircuitOptions, DeadPixelsAreSilent) {
  EventCameraOptions options = circuit(0.05);
  options.dead_pixels = 0.25;
  const Outcome done = run(
      options, [](double t) { return 0.3 + 0.2 * std::sin(40 * t); }, 100, 0.3);
  std::map<std::pair<int, int>, int> counts;
  for (const Event& e : done.events) ++counts[{e.x, e.y}];
  EXPECT_NEAR(static_cast<double>(counts.size()) / (kWidth * kHeight), 0.75, 0.06);
  options.dead_pixels = 1;
  EXPECT_TRUE(run(
                  options, [](double t) { return 0.3 + 0.2 * std::sin(40 * t); }, 100, 0.3)
                  .events.empty());
}

TEST(CircuitOptions, AnyLightIsSafe) {
  for (const double lux : {1e-9, 1e9}) {
    for (const double dark_fa : {1e-9, 1e9}) {
      EventCameraOptions options = circuit(0.3);
      options.circuit->white_lux = lux;
      options.circuit->dark_current_fa = dark_fa;
      options.refractory_period_us = 1000;
      EXPECT_NO_THROW(run(
          options, [](double t) { return 5 * t; }, 100, 0.05))
          << lux << " " << dark_fa;
    }
  }
}

}  // namespace
}  // namespace esim
