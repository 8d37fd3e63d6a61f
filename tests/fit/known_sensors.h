// Sensors with known parameters, simulated on a bench and fitted.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "esim/core/random.h"
#include "esim/event_camera/event_camera.h"
#include "esim/fit/background_fit.h"
#include "esim/fit/contrast_fit.h"
#include "esim/fit/shortest_intervals.h"

namespace esim::test {

inline constexpr int kSide = 64, kStepsPerImage = 5;
inline constexpr double kStep_s = 1e-3, kImageNoise = 0.01;

/// Draws of parameters of a sensor, between(draw, low, high), whose logarithms are uniform.
inline auto random_parameters(std::uint64_t seed, std::uint32_t number) {
  return [random = AddressedRandom(seed, Purpose::test), number](std::uint64_t draw, double low, double high) {
    return low * std::pow(high / low, random.uniforms(number, draw)[0]);
  };
}

/// A sensor with random parameters.
inline EventCameraOptions random_sensor(std::uint32_t number) {
  const auto between = random_parameters(7, number);
  EventCameraOptions o;
  o.contrast_threshold_on = between(0, 0.12, 0.4);
  o.contrast_threshold_off = *o.contrast_threshold_on * between(1, 0.8, 1.25);
  o.threshold_mismatch = *o.contrast_threshold_on * between(2, 0.02, 0.08);
  o.refractory_period_us = between(3, 100, 2000);
  o.leak_rate_hz = between(4, 0.08, 0.4);
  o.leak_mismatch_decades = between(5, 0.05, 0.3);
  o.hot_pixels = 0.005;
  o.hot_pixel_rate_hz = 300 * o.leak_rate_hz;
  return o;
}

/// Waves that move over the sensor, with a wide range of brightness.
inline Image<float> waves(double t) {
  Image<float> image(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double a = std::sin(0.35 * x + 0.2 * y + 9 * t), b = std::sin(0.13 * x - 0.4 * y + 14.3 * t + 1),
                   c = std::sin(0.6 * x + 0.5 * y - 23 * t);
      image(x, y) = static_cast<float>(0.3 * std::exp(0.6 * a + 0.5 * b + 0.25 * c));
    }
  }
  return image;
}

/// Events in constant light.
inline std::vector<Event> constant_light(const EventCameraOptions& sensor, float light, double seconds,
                                         std::uint64_t seed) {
  EventCamera camera(sensor, kSide, kSide, seed);
  const Image<float> image(kSide, kSide, light);
  const Workers workers(1);
  std::vector<Event> events;
  camera.process(image, 0, events, workers);
  camera.process(image, to_ns(seconds), events, workers);
  return events;
}

/// Events of waves, and images with noise of them.
inline ContrastFit::Result fit_waves(const EventCameraOptions& sensor, double refractory_s, double seconds,
                                     std::uint64_t seed) {
  EventCamera camera(sensor, kSide, kSide, seed);
  ContrastFit contrast(kSide, kSide, {refractory_s, sensor.dark_light(), false});
  const AddressedRandom random(seed, Purpose::test, 1);
  const Workers workers(1);
  std::vector<Event> events;
  for (int k = 0; k * kStep_s <= seconds; ++k) {
    const TimeNs t = to_ns(k * kStep_s);
    Image<float> image = waves(k * kStep_s);
    camera.process(image, t, events, workers);
    if (k % kStepsPerImage != 0) continue;
    for (std::size_t i = 0; i < image.size(); ++i) {
      const double noise = random.normals(static_cast<std::uint32_t>(i), static_cast<std::uint64_t>(k))[0];
      image.pixels()[i] *= static_cast<float>(1 + kImageNoise * noise);
    }
    contrast.add(t, image, events);
    events.clear();
  }
  return contrast.finish();
}

/// How well the values of many sensors agree with the truth, and their intervals contain it.
struct Coverage {
  const char* name;
  int inside = 0, sensors = 0;
  double widths = 0, squares = 0, worst = 0, deviations = 0;

  void add(const Estimate& e, double truth) {
    ++sensors;
    if (!e.determined()) {
      ADD_FAILURE() << name << ": " << e.reason;
      return;
    }
    inside += e.low <= truth && truth <= e.high;
    widths += (e.high - e.low) / truth;
    const double error = (e.value - truth) / truth;
    squares += error * error, worst = std::max(worst, std::abs(error));
    deviations += std::pow((e.value - truth) / ((e.high - e.low) / (2 * 1.96)), 2);
  }
  /// Mean width of the intervals over the one that the scatter of the values implies.
  double relative_width() const { return widths / sensors / (2 * 1.96 * std::sqrt(squares / sensors)); }
  /// The same if each sensor has errors of its own size: the standard deviations that the intervals state, over the
  /// errors.
  double stated_over_found() const { return 1 / std::sqrt(deviations / sensors); }
};

/// A minute of constant light with leak, ten seconds of noise, and five of waves.
inline std::array<Coverage, 7> fit_random_sensors(int sensors) {
  std::array<Coverage, 7> all{{{"contrast_threshold_on"},
                               {"contrast_threshold_off"},
                               {"threshold_mismatch"},
                               {"refractory_period_us"},
                               {"leak_rate_hz"},
                               {"leak_mismatch_decades"},
                               {"hot_pixels"}}};
  for (int i = 0; i < sensors; ++i) {
    const auto number = static_cast<std::uint32_t>(i);
    const EventCameraOptions truth = random_sensor(number);
    BackgroundFit background(kSide, kSide);
    background.add(constant_light(truth, 0.5F, 60, 100 * number));
    const auto leak = background.finish(60, truth.threshold_off() / truth.threshold_on());

    EventCameraOptions noisy = truth;
    noisy.shot_noise_hz = 40, noisy.leak_rate_hz = 0, noisy.hot_pixels = 0;
    ShortestIntervals intervals(kSide, kSide);
    intervals.add(constant_light(noisy, 0.01F, 10, 100 * number + 1));
    const Estimate refractory = intervals.finish(1).refractory;

    const double refractory_s = refractory.determined() ? 1e-6 * refractory.value : 0.0;
    const auto contrast = fit_waves(truth, refractory_s, 5, 100 * number + 2);
    all[0].add(contrast.on, truth.threshold_on());
    all[1].add(contrast.off, truth.threshold_off());
    all[2].add(contrast.mismatch, truth.threshold_mismatch);
    all[3].add(refractory, truth.refractory_period_us);
    all[4].add(leak.leak_rate, truth.leak_rate_hz);
    all[5].add(leak.leak_decades, truth.leak_mismatch_decades);
    all[6].add(leak.hot_pixels, truth.hot_pixels);
  }
  return all;
}

}  // namespace esim::test
