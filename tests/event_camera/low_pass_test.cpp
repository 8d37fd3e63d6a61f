// The photoreceptor's low-pass, measured from the events after it.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "event_camera/feed.h"

namespace esim {
namespace {

using test::Feed;

constexpr double kDark = 0.05;

EventCameraOptions low_pass(double hz, int order) {
  EventCameraOptions options;
  options.contrast_threshold = 0.05;
  options.low_pass_hz = hz;
  options.low_pass_order = order;
  options.dark_irradiance = kDark;
  return options;
}

double time_constant_s(const EventCameraOptions& o, double light) {
  const double per_pole = o.low_pass_order == 2 ? std::sqrt(std::numbers::sqrt2 - 1) : 1;
  return per_pole / (2 * std::numbers::pi * o.low_pass_hz) * (1 + kDark) / (light + kDark);
}

TEST(LowPass, AnswersAStepAsItsFormulaSays) {
  for (const int order : {1, 2}) {
    for (const double light : {1.0, 0.2, 0.01}) {
      for (const int samples : {1, 3, 1000}) {  // of the constant irradiance after the step
        const EventCameraOptions options = low_pass(200, order);
        Feed feed(options, 1, 1);
        const float before = static_cast<float>((light + options.log_eps) * std::exp(-1.0) - options.log_eps);
        const Image<float> after(1, 1, static_cast<float>(light));
        feed.frame(Image<float>(1, 1, before), -1);
        feed.frame(after, 0);
        const double tau = time_constant_s(options, light);
        const TimeNs end = to_ns(8 * tau);
        for (int k = 1; k <= samples; ++k) feed.frame(after, end * k / samples);
        const std::vector<Event> events = feed.events();
        ASSERT_EQ(events.size(), 19U) << order << " " << light << " " << samples;  // the 20th level is only approached
        for (std::size_t k = 0; k < events.size(); ++k) {
          const double u = to_seconds(events[k].t) / tau;
          const double response = order == 1 ? 1 - std::exp(-u) : 1 - (1 + u) * std::exp(-u);
          EXPECT_NEAR(response, 0.05 * static_cast<double>(k + 1), 2e-5);
          EXPECT_EQ(events[k].polarity, 1);
        }
      }
    }
  }
}

/// Amplitude of the brightness after the low-pass at a frequency, from the number of events in ten periods.
double measured_amplitude(const EventCameraOptions& options, double frequency_hz, double amplitude) {
  constexpr int kSamplesPerPeriod = 400, kPeriods = 20;
  Feed feed(options, 1, 1);
  const double period_s = 1 / frequency_hz;
  std::size_t count = 0;
  for (int k = 0; k <= kPeriods * kSamplesPerPeriod; ++k) {
    const double phase = 2 * std::numbers::pi * k / kSamplesPerPeriod;
    feed.frame(Image<float>(1, 1, static_cast<float>(std::exp(amplitude * std::sin(phase) - 3))),
               to_ns(period_s * k / kSamplesPerPeriod));
    const std::size_t fired = feed.events(to_ns(period_s * k / kSamplesPerPeriod)).size();
    if (k > kPeriods / 2 * kSamplesPerPeriod) count += fired;
  }
  // Each period covers the peak-to-peak swing twice; each extremum loses less than a threshold.
  return (static_cast<double>(count) / (kPeriods / 2) + 1) * options.contrast_threshold / 4;
}

TEST(LowPass, LosesThreeDecibelsAtItsCutOff) {
  constexpr double kAmplitude = 1.0;
  for (const int order : {1, 2}) {
    EventCameraOptions options = low_pass(100, order);
    options.contrast_threshold = 0.01;
    options.log_eps = 1e-9;
    options.dark_irradiance = 10;  // the irradiance hardly matters relative to the dark irradiance
    const double intensity = (10 + std::exp(-3)) / 11;
    for (const double relative : {0.1, 1.0, 3.0}) {
      const double f = relative * 100 * intensity;
      const double w = order == 2 ? relative * std::sqrt(std::numbers::sqrt2 - 1) : relative;
      const double expected = order == 1 ? 1 / std::sqrt(1 + w * w) : 1 / (1 + w * w);
      EXPECT_NEAR(measured_amplitude(options, f, kAmplitude), expected, 0.006) << order << ", " << relative;
      if (relative == 1.0) {
        EXPECT_NEAR(expected, std::sqrt(0.5), 1e-12);
      }
    }
  }
}

/// The same pixel by Euler's method in steps of 20 ns, with a refractory period and a leak.
std::vector<Event> by_small_steps(const EventCameraOptions& o, const std::vector<float>& light, TimeNs interval) {
  std::vector<Event> events;
  const double step_s = 20e-9;
  const auto brightness = [&](double e) { return std::log(e + o.log_eps); };
  double f1 = brightness(light[0]), f2 = f1, reference = f1;
  double busy_until = -1, t = 0;
  for (std::size_t k = 1; k < light.size(); ++k) {
    // The time constant is that of the segment's mean irradiance.
    const double e0 = light[k - 1], e1 = light[k], mean = (e0 + 4 * std::sqrt(e0 * e1) + e1) / 6;
    const double tau = time_constant_s(o, mean), l0 = brightness(e0), l1 = brightness(e1);
    const int steps = static_cast<int>(std::llround(to_seconds(interval) / step_s));
    for (int i = 0; i < steps; ++i, t += step_s) {
      const double l = l0 + (l1 - l0) * (i + 0.5) / steps;
      const double f1_before = f1;
      f1 += step_s / tau * (l - f1);
      f2 += step_s / tau * (0.5 * (f1 + f1_before) - f2);
      const double f = o.low_pass_order == 1 ? f1 : f2;
      if (t < busy_until) {
        reference = f;
        continue;
      }
      if (std::fabs(f - reference) < o.contrast_threshold) continue;
      events.push_back({to_ns(t), 0, 0, static_cast<std::int8_t>(f > reference ? 1 : -1)});
      reference += f > reference ? o.contrast_threshold : -o.contrast_threshold;
      busy_until = t + o.refractory_period_us * 1e-6;
    }
  }
  return events;
}

TEST(LowPass, AgreesWithSmallSteps) {
  constexpr TimeNs kInterval = kNsPerMs / 2;
  unsigned seed = 0;
  for (const int order : {1, 2}) {
    for (const double hz : {50.0, 400.0, 3000.0}) {
      for (const double refractory_us : {0.0, 150.0}) {
        EventCameraOptions options = low_pass(hz, order);
        options.contrast_threshold = 0.11;
        options.refractory_period_us = refractory_us;
        std::mt19937 random(++seed);
        std::normal_distribution<float> normal;
        std::vector<float> light = {0.3F};
        while (light.size() < 40) light.push_back(light.back() * std::exp(0.3F * normal(random)));

        Feed feed(options, 1, 1);
        for (std::size_t k = 0; k < light.size(); ++k)
          feed.frame(Image<float>(1, 1, light[k]), kInterval * static_cast<TimeNs>(k));
        const std::vector<Event> events = feed.events(), expected = by_small_steps(options, light, kInterval);
        ASSERT_EQ(events.size(), expected.size()) << order << ", " << hz << " Hz, " << refractory_us << " us";
        for (std::size_t i = 0; i < events.size(); ++i) {
          EXPECT_NEAR(static_cast<double>(events[i].t), static_cast<double>(expected[i].t), 1000) << i;
          EXPECT_EQ(events[i].polarity, expected[i].polarity);
        }
      }
    }
  }
}

}  // namespace
}  // namespace esim
