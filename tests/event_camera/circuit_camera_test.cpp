// Cameras whose pixels are simulated by their circuit: what does not change their events, and what they do.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/event_camera/event_camera.h"
#include "esim/stats/sensor/sensor_statistics.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kWidth = 37, kHeight = 21;

EventCameraOptions dim() {
  EventCameraOptions options;
  options.contrast_threshold = 0.12;
  options.threshold_ratio = 1.2;
  options.threshold_mismatch = 0.005;
  options.refractory_period_us = 300;
  options.leak_rate_hz = 0.2;
  options.leak_mismatch_decades = 0.3;
  options.hot_pixels = 0.02;
  options.circuit = CircuitOptions{};
  options.circuit->white_lux = 5;
  options.circuit->threshold_mismatch_common = 0.07;
  options.circuit->noise_mismatch_decades = 0.05;
  return options;
}

/// With all parts that not every circuit has.
EventCameraOptions filtered() {
  EventCameraOptions options = dim();
  options.circuit->high_pass_hz = 0.4;
  options.circuit->leak_hz_per_klux = 300;  // in this light, three times the leak without light
  options.circuit->frame_coupling = 0.03, options.circuit->frame_rate_hz = 30, options.circuit->frame_exposure_ms = 9;
  return options;
}

using Light = std::function<float(int x, int y, double t_s)>;

Image<float> image_of(const Light& light, double t_s) {
  Image<float> image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) image(x, y) = light(x, y, t_s);
  }
  return image;
}

/// All events of a camera that gets samples of the light at a rate.
std::vector<Event> events_of(const EventCameraOptions& options, const Light& light, double rate_hz, double duration_s,
                             int threads = 1) {
  EventCamera camera(options, kWidth, kHeight, 3);
  const Workers workers(threads);
  std::vector<Event> events;
  const auto count = static_cast<int>(std::lround(duration_s * rate_hz));
  for (int k = 0; k <= count; ++k) {
    const double t_s = k / rate_hz;
    camera.process(image_of(light, t_s), static_cast<TimeNs>(std::llround(t_s * 1e9)), events, workers);
  }
  return events;
}

Light moving_waves() {
  return [](int x, int y, double t) {
    return static_cast<float>(0.5 + 0.45 * std::sin(0.9 * x + 0.4 * y + 12 * t) * std::cos(0.35 * y - 5 * t));
  };
}

TEST(CircuitCamera, ThreadsAndTilesDoNotChangeItsEvents) {
  for (const bool has_readout : {false, true}) {
    EventCameraOptions options = filtered();
    if (has_readout)
      options.readout = {.rate_mev_per_s = 2, .row_time_us = 1, .row_wait_us = 20, .column_coupling = 0.7};
    const std::vector<Event> expected = events_of(options, moving_waves(), 500, 1);
    ASSERT_GT(expected.size(), 2000U);
    EXPECT_EQ(events_of(options, moving_waves(), 500, 1, 3), expected);

    // The left part in segments of one sample, the right part in pairs of samples.
    EventCamera camera(options, kWidth, kHeight, 3);
    const Workers workers(2);
    const Tile left{0, 0, 16, kHeight}, right{16, 0, kWidth - 16, kHeight};
    std::vector<Image<float>> images;
    for (int k = 0; k <= 500; ++k) images.push_back(image_of(moving_waves(), k / 500.0));
    std::vector<Event> events;
    const auto segment = [&](const Tile& tile, int from, int to) {
      return Segment{tile, from * 2 * kNsPerMs, to * 2 * kNsPerMs, &images[static_cast<std::size_t>(from)],
                     &images[static_cast<std::size_t>(to)]};
    };
    camera.integrate(std::vector{segment(left, 0, 0), segment(right, 0, 0)}, 0, workers);
    for (int k = 0; k < 500; k += 2) {
      camera.integrate(std::vector{segment(left, k, k + 1)}, k * 2 * kNsPerMs, workers);
      camera.integrate(std::vector{segment(right, k, k + 1), segment(right, k + 1, k + 2), segment(left, k + 1, k + 2)},
                       (k + 2) * 2 * kNsPerMs, workers);
      std::ranges::copy(camera.release_until((k + 2) * 2 * kNsPerMs), std::back_inserter(events));
    }
    EXPECT_EQ(events, expected) << has_readout;
  }
}

TEST(CircuitCamera, EventsInConstantLightDoNotDependOnTheSampling) {
  const Light constant = [](int x, int y, double) { return 0.02F + 0.01F * static_cast<float>((x + y) % 7); };
  for (const EventCameraOptions& options : {dim(), filtered()}) {
    const std::vector<Event> expected = events_of(options, constant, 200, 2);
    ASSERT_GT(expected.size(), 500U);
    EXPECT_TRUE(events_of(options, constant, 1000, 2) == expected);
    EXPECT_TRUE(events_of(options, constant, 20000, 2) == expected);
  }
}

/// The mean rate of ON minus OFF events of a pixel.
double drift_hz(const std::vector<Event>& events, double from_s, double to_s) {
  double sum = 0;
  for (const Event& e : events) {
    const double t_s = 1e-9 * static_cast<double>(e.t);
    if (t_s >= from_s && t_s < to_s) sum += e.polarity;
  }
  return sum / (kWidth * kHeight * (to_s - from_s));
}

TEST(CircuitCamera, LeakRisesWithLight) {
  EventCameraOptions options = dim();
  options.hot_pixels = 0;
  options.leak_mismatch_decades = 0;
  options.threshold_ratio = 1;
  options.circuit->threshold_mismatch_common = 0;
  options.circuit->noise = 0;
  options.circuit->white_lux = 20000;
  options.circuit->leak_hz_per_klux = 0.4;
  const double lux = options.circuit->white_sensor_lux();
  ASSERT_NEAR(lux, 20000 * options.circuit->transmission / (4 * std::pow(options.circuit->f_number, 2)), 1e-9);
  for (const double irradiance : {0.0, 0.3, 1.0}) {
    const std::vector<Event> events = events_of(
        options, [&](int, int, double) { return static_cast<float>(irradiance); }, 100, 40);
    const double expected = options.leak_rate_hz + 1e-3 * options.circuit->leak_hz_per_klux * lux * irradiance;
    EXPECT_NEAR(drift_hz(events, 5, 40), expected, 0.02 * expected) << irradiance;
  }
}

TEST(CircuitCamera, AHighPassForgetsSlowChanges) {
  EventCameraOptions options = dim();
  options.leak_rate_hz = 0, options.hot_pixels = 0, options.threshold_mismatch = 0, options.threshold_ratio = 1;
  options.circuit->threshold_mismatch_common = 0;
  options.circuit->noise = 0;
  options.circuit->dark_current_fa = 1e-6;
  options.circuit->white_lux = 1000;
  const double rate = 2, theta = options.contrast_threshold;
  const Light rising = [&](int, int, double t) { return static_cast<float>(0.01 * std::exp(rate * t)); };
  // Behind a high-pass, brightness that rises evenly settles at rate / (2 pi f). The references begin anywhere between
  // both thresholds, so that half a threshold is missing in the mean.
  options.circuit->high_pass_hz = 0.5;
  const double settled = rate / (2 * std::numbers::pi * 0.5);
  const std::vector<Event> events = events_of(options, rising, 1000, 3);
  EXPECT_NEAR(drift_hz(events, 0, 3) * 3 * theta, settled - 0.5 * theta, 0.01 * settled);
  EXPECT_EQ(drift_hz(events, 2.5, 3), 0);
  options.circuit->high_pass_hz = 0;
  EXPECT_NEAR(drift_hz(events_of(options, rising, 1000, 3), 0, 3) * 3 * theta, rate * 3 - 0.5 * theta, 0.02 * rate);
}

TEST(CircuitCamera, EventsOnRampsDoNotDependOnTheSampling) {
  // Linear in log-irradiance after the first instant, as segments are.
  const Light ramp = [](int x, int y, double t) {
    return static_cast<float>(0.2 * std::exp((0.3 * ((x * 7 + y * 3) % 11) - 1.5) * t));
  };
  double near = 0, all = 0;
  for (const double white_lux : {100.0, 1000.0}) {
    EventCameraOptions options = dim();
    options.circuit->white_lux = white_lux;
    options.circuit->dark_current_fa = 1e-6;  // otherwise the ramp of L would not be linear between samples
    const std::vector<Event> expected = events_of(options, ramp, 20000, 1);
    ASSERT_GT(expected.size(), 3000U);
    for (const double rate_hz : {200.0, 1000.0}) {
      const std::vector<Event> events = events_of(options, ramp, rate_hz, 1);
      std::multimap<std::tuple<int, int, int>, TimeNs> times;
      for (const Event& e : expected) times.emplace(std::tuple{e.x, e.y, e.polarity}, e.t);
      for (const Event& e : events) {
        const auto [begin, end] = times.equal_range({e.x, e.y, e.polarity});
        const auto found =
            std::find_if(begin, end, [&](const auto& entry) { return std::abs(entry.second - e.t) <= kNsPerUs; });
        if (found == end) continue;
        times.erase(found);
        ++near;
      }
      all += static_cast<double>(std::max(events.size(), expected.size()));
    }
  }
  // All of them here, which is not guaranteed. An event's time depends on the rounding errors of the irradiance, which
  // each reference amplifies that is taken while the noise moves faster than the signal.
  EXPECT_GE(near, 0.9985 * all);
}

TEST(CircuitCamera, ContinuesFromASavedState) {
  const EventCameraOptions options = filtered();
  const Workers workers(1);
  EventCamera first(options, kWidth, kHeight, 3), second(options, kWidth, kHeight, 3);
  std::vector<Event> whole, parts;
  for (int k = 0; k <= 200; ++k) first.process(image_of(moving_waves(), k * 1e-3), k * kNsPerMs, whole, workers);
  EventCamera before(options, kWidth, kHeight, 3);
  for (int k = 0; k <= 100; ++k) before.process(image_of(moving_waves(), k * 1e-3), k * kNsPerMs, parts, workers);
  second.restore(before.state());
  for (int k = 101; k <= 200; ++k) second.process(image_of(moving_waves(), k * 1e-3), k * kNsPerMs, parts, workers);
  EXPECT_EQ(parts, whole);
}

TEST(CircuitCamera, NoiseAlternatesInTheDarkAndFallsSilentInLight) {
  const auto rate_and_alternation = [](double irradiance) {
    EventCameraOptions options = dim();
    options.leak_rate_hz = 0, options.hot_pixels = 0;
    const auto events = events_of(
        options, [&](int, int, double) { return static_cast<float>(irradiance); }, 100, 10);
    std::map<std::pair<int, int>, int> last;
    double pairs = 0, alternating = 0;
    for (const Event& e : events) {
      int& before = last[{e.x, e.y}];
      if (before != 0) pairs += 1, alternating += before != e.polarity ? 1 : 0;
      before = e.polarity;
    }
    return std::pair{static_cast<double>(events.size()) / (10.0 * kWidth * kHeight),
                     alternating / std::max(pairs, 1.0)};
  };
  const auto [dark_hz, alternation] = rate_and_alternation(0.02);
  const auto [light_hz, unused] = rate_and_alternation(1e5);
  static_cast<void>(unused);
  EXPECT_GT(dark_hz, 0.2);
  EXPECT_GT(alternation, 0.9);
  EXPECT_LT(light_hz, 1e-3);
}

SensorStatistics statistics_of(const std::vector<Event>& events) {
  SensorStatisticsCounter counter(SensorSize{kWidth, kHeight});
  counter.add(events);
  return std::move(counter).finish();
}

TEST(CircuitCamera, RowsAreReadSomeTimeAfterTheirFirstRequest) {
  EventCameraOptions options = dim();
  options.readout = {.row_time_us = 0.3, .time_stamp_us = 1};
  const SensorStatistics at_once = statistics_of(events_of(options, moving_waves(), 500, 5));
  options.readout.row_wait_us = 8;
  const SensorStatistics waiting = statistics_of(events_of(options, moving_waves(), 500, 5));
  ASSERT_GT(waiting.events, 20'000U);
  EXPECT_LT(std::abs(at_once.row_wait.mean_us), 1 + 4 * at_once.row_wait.deviation_us);
  ASSERT_LT(waiting.row_wait.deviation_us, 1);
  const double rows = 1e-6 * static_cast<double>(waiting.events) / waiting.duration_s * 8;  // that wait
  EXPECT_NEAR(waiting.row_wait.mean_us, 8 * (1 + rows / 16), 0.5 + 4 * waiting.row_wait.deviation_us);
  EXPECT_GT(waiting.same_us.row_over_chance(kHeight), 4 * at_once.same_us.row_over_chance(kHeight));
  // As many events: a few us of waiting do not matter for a refractory period of 300 us.
  EXPECT_NEAR(static_cast<double>(waiting.events), static_cast<double>(at_once.events),
              0.03 * static_cast<double>(at_once.events));
}

/// Pairs of events of a column in different rows, the second 0 or 1 us after the first, by the second one's polarity.
std::array<int, 2> pairs_of_columns(const std::vector<Event>& events) {
  std::array<int, 2> pairs{};
  for (std::size_t i = 0; i < events.size(); ++i) {
    for (std::size_t j = i + 1; j < events.size() && events[j].t <= events[i].t + kNsPerUs; ++j) {
      if (events[i].x == events[j].x && events[i].y != events[j].y) ++pairs[events[j].polarity > 0 ? 1 : 0];
    }
  }
  return pairs;
}

TEST(CircuitCamera, ColumnsCallTheRowsOfWaitingOnEvents) {
  EventCameraOptions options = dim();
  options.readout = {.row_time_us = 0.3, .row_wait_us = 12, .time_stamp_us = 1};
  const auto [off_alone, on_alone] = pairs_of_columns(events_of(options, moving_waves(), 500, 5));
  options.readout.column_coupling = 1;
  const auto [off, on] = pairs_of_columns(events_of(options, moving_waves(), 500, 5));
  ASSERT_GT(on_alone, 20);
  EXPECT_GT(on, 3 * on_alone);
  // OFF events are not called, but share the time of rows that are.
  EXPECT_LT(off, on_alone + (on - on_alone) / 2);
  EXPECT_GT(off_alone, 0);
}

TEST(CircuitCamera, ScansStampByColumnAndScan) {
  EventCameraOptions options = dim();
  options.readout.scan_period_us = 197.3;
  const TimeNs period = to_ns(197.3e-6);
  const std::vector<Event> events = events_of(options, moving_waves(), 500, 0.5);
  ASSERT_GT(events.size(), 500U);
  for (const Event& e : events) EXPECT_EQ((e.t - period * e.x / kWidth) % period, 0);
}

TEST(CircuitCamera, OptionsOfTheOtherModelAreRefused) {
  EventCameraOptions options = dim();
  options.shot_noise_hz = 5;
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { EventCamera(options, 8, 8); }), "shot_noise_hz"));
}

}  // namespace
}  // namespace esim
