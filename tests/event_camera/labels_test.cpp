// The explanations of events: the same as those of the reference, and what they must say of simple scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <tuple>
#include <vector>

#include "esim/core/error.h"
#include "esim/event_camera/event_camera.h"
#include "esim/event_camera/reference.h"
#include "event_camera/feed.h"

namespace esim {
namespace {

constexpr int kWidth = 36, kHeight = 10;

/// What a camera reported.
struct Explained {
  std::vector<Event> events;
  std::vector<EventLabel> labels;

  friend bool operator==(const Explained&, const Explained&) = default;

  void add(EventCamera& camera, const Image<float>& frame, TimeNs t, const Workers& workers = test::kOneThread) {
    camera.process(frame, t, events, workers);
    labels.insert(labels.end(), camera.labels().begin(), camera.labels().end());
  }
  /// Sorted by pixel, then by the ideal time.
  void sort() {
    std::vector<std::size_t> order(events.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::sort(order, {}, [&](std::size_t i) {
      return std::tuple(events[i].y, events[i].x, labels[i].t_ideal, events[i].t, events[i].polarity);
    });
    const Explained unsorted = *this;
    for (std::size_t i = 0; i < order.size(); ++i)
      events[i] = unsorted.events[order[i]], labels[i] = unsorted.labels[order[i]];
  }
};

double sum(const EventLabel& label) {
  return static_cast<double>(label.signal) + label.flicker + label.noise + label.leak;
}

using Light = std::function<float(int x, int y, double t_s)>;

float waves(int x, int y, double t) {
  return static_cast<float>(0.5 + 0.45 * std::sin(0.9 * x + 0.4 * y + 12 * t) * std::cos(0.35 * y - 5 * t));
}

Explained run(const EventCameraOptions& options, const Light& light, double rate_hz, double duration_s,
              int threads = 1) {
  EventCamera camera(options, kWidth, kHeight, 3);
  const Workers workers(threads);
  Explained out;
  for (int k = 0; k <= std::lround(rate_hz * duration_s); ++k) {
    Image<float> frame(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) frame(x, y) = light(x, y, k / rate_hz);
    }
    out.add(camera, frame, std::llround(k / rate_hz * 1e9), workers);
  }
  return out;
}

std::vector<Image<float>> random_frames(int count) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<Image<float>> frames(1, Image<float>(kWidth, kHeight, 0.3F));
  while (static_cast<int>(frames.size()) < count) {
    Image<float> next = frames.back();
    for (float& value : next.pixels())
      value = std::clamp(value * std::exp((random() % 4 == 0 ? 1.5F : 0.1F) * normal(random)), 0.0F, 50.0F);
    frames.push_back(next);
  }
  return frames;
}

/// Every effect at once.
EventCameraOptions everything(RefractoryMode mode) {
  return {.contrast_threshold = 0.2,
          .contrast_threshold_off = 0.3,
          .threshold_mismatch = 0.05,
          .threshold_noise = 0.02,
          .refractory_period_us = 300,
          .refractory_mode = mode,
          .leak_rate_hz = 20,
          .leak_mismatch_decades = 0.1,
          .leak_jitter = 0.1,
          .shot_noise_hz = 50,
          .hot_pixels = 0.05,
          .dead_pixels = 0.02,
          .latency_us = 200,
          .latency_jitter_us = 60,
          .latency_light_share = 0.7,
          .labels = true};
}

EventCameraOptions with(EventCameraOptions options, const std::function<void(EventCameraOptions&)>& change) {
  change(options);
  return options;
}

/// A circuit in dim light, with all its effects.
EventCameraOptions dim_circuit() {
  EventCameraOptions options{.contrast_threshold = 0.12, .threshold_ratio = 1.2, .threshold_mismatch = 0.005};
  options.refractory_period_us = 300;
  options.leak_rate_hz = 0.2;
  options.leak_mismatch_decades = 0.3;
  options.hot_pixels = 0.05;
  options.labels = true;
  options.circuit = CircuitOptions{};
  options.circuit->white_lux = 5;
  options.circuit->threshold_mismatch_common = 0.07;
  return options;
}

const ReadoutOptions kSlowReadout{.rate_mev_per_s = 0.05, .row_time_us = 100};
const ReadoutOptions kFullReadout{.rate_mev_per_s = 0.05, .row_time_us = 100, .queue_events = 20};

std::vector<EventCameraOptions> separate_effects() {
  const auto hold = everything(RefractoryMode::hold), drop = everything(RefractoryMode::drop);
  return {
      {.labels = true},
      {.contrast_threshold = 0.2, .threshold_mismatch = 0.05, .refractory_period_us = 300, .labels = true},
      {.contrast_threshold = 0.3, .threshold_noise = 0.1, .labels = true},
      {.contrast_threshold = 0.3, .leak_rate_hz = 100, .leak_jitter = 0.2, .labels = true},
      {.contrast_threshold = 0.3, .shot_noise_hz = 1000, .labels = true},
      {.contrast_threshold = 0.2, .latency_us = 50, .latency_jitter_us = 2000, .labels = true},
      hold,
      drop,
      with(hold, [](auto& o) { o.low_pass_hz = 500; }),
      with(hold, [](auto& o) { o.low_pass_hz = 500, o.low_pass_order = 2; }),
      with(hold, [](auto& o) { o.surround_px = 2, o.surround_ms = 3; }),
      with(drop, [](auto& o) { o.response = PixelResponse::lin_log; }),
  };
}

std::vector<EventCameraOptions> with_readouts() {
  const auto hold = everything(RefractoryMode::hold), drop = everything(RefractoryMode::drop);
  std::vector<EventCameraOptions> all;
  for (const ReadoutOptions& readout : {kSlowReadout, kFullReadout}) {
    all.push_back({.contrast_threshold = 0.2, .refractory_period_us = 100, .readout = readout, .labels = true});
    all.push_back(with(hold, [&](auto& o) { o.readout = readout; }));
    all.push_back(with(drop, [&](auto& o) { o.readout = readout; }));
    all.push_back(with(hold, [&](auto& o) { o.readout = readout, o.low_pass_hz = 500; }));
  }
  return all;
}

std::vector<EventCameraOptions> circuits() {
  const EventCameraOptions circuit = dim_circuit();
  return {circuit,
          with(circuit, [](auto& o) { o.circuit->noise = 0; }),
          with(circuit, [](auto& o) { o.refractory_period_us = 0; }),
          with(circuit,
               [](auto& o) {
                 o.readout = {.rate_mev_per_s = 2, .row_time_us = 1, .row_wait_us = 20, .column_coupling = 0.7};
               }),
          with(circuit, [](auto& o) { o.readout = {.scan_period_us = 200}; }),
          with(circuit, [](auto& o) { o.readout = {.scan_period_us = 200, .time_stamp_us = 7}; }),
          with(circuit, [](auto& o) { o.readout = {.rate_mev_per_s = 2, .row_time_us = 1, .time_stamp_us = 1}; }),
          with(circuit, [](auto& o) { o.circuit->max_rate_hz = 200; })};
}

std::vector<EventCameraOptions> all_cameras() {
  std::vector<EventCameraOptions> all = separate_effects();
  for (const EventCameraOptions& options : with_readouts()) all.push_back(options);
  for (const EventCameraOptions& options : circuits()) all.push_back(options);
  return all;
}

class Labels : public testing::TestWithParam<EventCameraOptions> {};

TEST_P(Labels, DoNotChangeTheEvents) {
  EventCameraOptions without = GetParam();
  without.labels = false;
  const Explained explained = run(GetParam(), waves, 500, 0.5), plain = run(without, waves, 500, 0.5);
  EXPECT_GT(explained.events.size(), 500U);
  EXPECT_EQ(explained.events, plain.events);
  EXPECT_EQ(explained.labels.size(), explained.events.size());
  EXPECT_TRUE(plain.labels.empty());
}

TEST_P(Labels, DoNotDependOnThreadsOrTiles) {
  const EventCameraOptions& options = GetParam();
  const Explained expected = run(options, waves, 500, 0.3);
  EXPECT_EQ(run(options, waves, 500, 0.3, 3), expected);
  if (options.surround_px > 0) return;

  // The left part in segments of one sample, the right part in pairs of samples.
  EventCamera camera(options, kWidth, kHeight, 3);
  const Workers workers(2);
  const Tile left{0, 0, 16, kHeight}, right{16, 0, kWidth - 16, kHeight};
  std::vector<Image<float>> images;
  for (int k = 0; k <= 150; ++k) {
    images.emplace_back(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) images.back()(x, y) = waves(x, y, k / 500.0);
    }
  }
  const auto time = [](int k) { return static_cast<TimeNs>(std::llround(k / 500.0 * 1e9)); };
  const auto segment = [&](const Tile& tile, int k) {
    const int from = std::max(k - 1, 0);
    return Segment{tile, time(from), time(k), &images[static_cast<std::size_t>(from)],
                   &images[static_cast<std::size_t>(k)]};
  };
  Explained tiled;
  for (int k = 0; k <= 150; k += 2) {
    if (k > 0) {
      const std::vector<Segment> one{segment(left, k - 1)};
      camera.integrate(one, time(k - 2), workers);
    }
    std::vector<Segment> rest{segment(left, k)};
    if (k > 0) rest.push_back(segment(right, k - 1));
    rest.push_back(segment(right, k));
    camera.integrate(rest, time(k), workers);
    std::ranges::copy(camera.release_until(time(k)), std::back_inserter(tiled.events));
    tiled.labels.insert(tiled.labels.end(), camera.labels().begin(), camera.labels().end());
  }
  EXPECT_EQ(tiled.events, expected.events);
  EXPECT_EQ(tiled.labels, expected.labels);
}

TEST_P(Labels, AddUpToTheThresholdsOfTheirPixels) {
  const EventCameraOptions& options = GetParam();
  const Explained explained = run(options, waves, 500, 0.5);
  std::map<std::tuple<int, int, int>, double> thresholds;
  for (std::size_t i = 0; i < explained.events.size(); ++i) {
    const Event& event = explained.events[i];
    const EventLabel& label = explained.labels[i];
    const double threshold = event.polarity * sum(label);
    const auto [known, is_new] = thresholds.try_emplace({event.x, event.y, event.polarity}, threshold);
    EXPECT_NEAR(threshold, known->second, 1e-5);
    const double nominal = event.polarity > 0 ? options.threshold_on() : options.threshold_off();
    const double common = options.circuit ? options.circuit->threshold_mismatch_common : 0;
    EXPECT_NEAR(threshold, nominal, 1e-6 + 5 * (options.threshold_mismatch + nominal * common));
    EXPECT_GT(label.t_ideal, 0);
    EXPECT_LE(label.t_ideal, event.t);
    EXPECT_EQ(label.flicker, 0);
    const bool is_noiseless =
        options.threshold_noise == 0 && options.shot_noise_hz == 0 && (!options.circuit || options.circuit->noise == 0);
    EXPECT_TRUE(!is_noiseless || label.noise == 0);
    EXPECT_TRUE(options.leak_rate_hz > 0 || label.leak == 0);
    const std::array<float, 4> parts{label.signal, label.flicker, label.noise, label.leak};
    const auto cause = static_cast<std::size_t>(label.cause);
    // Of the separate effects, shot noise is the cause of its events whatever its part is.
    if (label.cause == EventCause::noise && options.shot_noise_hz > 0) continue;
    for (const float part : parts) EXPECT_GE(event.polarity * parts[cause], event.polarity * part);
  }
}

TEST_P(Labels, ARestoredCameraContinuesThem) {
  EventCamera camera(GetParam(), kWidth, kHeight, 3), restored(GetParam(), kWidth, kHeight, 3);
  const std::vector<Image<float>> frames = random_frames(20);
  Explained before, expected, continued;
  for (int k = 0; k < 10; ++k) before.add(camera, frames[static_cast<std::size_t>(k)], k * kNsPerMs);
  restored.restore(camera.state());
  EXPECT_EQ(restored.labels_from(), camera.labels_from());
  for (int k = 10; k < 20; ++k) {
    expected.add(camera, frames[static_cast<std::size_t>(k)], k * kNsPerMs);
    continued.add(restored, frames[static_cast<std::size_t>(k)], k * kNsPerMs);
  }
  EXPECT_GT(expected.events.size(), 10U);
  EXPECT_EQ(continued, expected);
}

/// All filters of a sensor; each drops some of the events of these cameras.
FilterOptions all_filters() {
  FilterOptions filters;
  filters.region = RegionFilterOptions{false, {{2, 1, kWidth - 5, kHeight - 2}}, {{5, 5}, {20, 8}}};
  filters.activity = ActivityFilterOptions{1000, 500, 250, 0, 0};
  filters.anti_flicker = AntiFlickerOptions{FlickerMode::band_stop, 50, 5000, 4, 2};
  filters.trail = TrailFilterOptions{TrailType::stc_keep_trail, 20'000};
  filters.rate_controller = RateControllerOptions{1000, 40};
  return filters;
}

TEST_P(Labels, PassTheFiltersOfTheSensorWithTheirEvents) {
  const Explained all = run(GetParam(), waves, 500, 0.5);
  FilterOptions only_trail;
  only_trail.trail = TrailFilterOptions{TrailType::stc_keep_trail, 20'000};
  for (const FilterOptions& filters : {all_filters(), only_trail}) {
    EventCameraOptions options = GetParam();
    options.filters = filters;
    const Explained passed = run(options, waves, 500, 0.5);
    EXPECT_LT(passed.events.size(), all.events.size());
    EXPECT_GT(passed.events.size(), 10U);
    ASSERT_EQ(passed.labels.size(), passed.events.size());
    // One of the labels that the same event has without filters. Different events may be equal.
    std::multimap<std::tuple<TimeNs, int, int, int>, EventLabel> labels;
    const auto key = [](const Event& e) { return std::tuple<TimeNs, int, int, int>(e.t, e.y, e.x, e.polarity); };
    for (std::size_t i = 0; i < all.events.size(); ++i) labels.emplace(key(all.events[i]), all.labels[i]);
    for (std::size_t i = 0; i < passed.events.size(); ++i) {
      const auto [first, last] = labels.equal_range(key(passed.events[i]));
      EXPECT_TRUE(std::any_of(first, last, [&](const auto& each) { return each.second == passed.labels[i]; }));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, Labels, testing::ValuesIn(all_cameras()));

class LabelsAgainstReference : public testing::TestWithParam<EventCameraOptions> {};

TEST_P(LabelsAgainstReference, AreTheSame) {
  EventCamera camera(GetParam(), kWidth, kHeight, 9);
  ReferenceEventCamera reference(GetParam(), kWidth, kHeight, 9);
  Explained fast, defined;
  std::mt19937 random(3);
  TimeNs t = -1000;
  for (const Image<float>& frame : random_frames(60)) {
    fast.add(camera, frame, t);
    for (const Event& event : reference.process(frame, t)) defined.events.push_back(event);
    defined.labels.insert(defined.labels.end(), reference.labels().begin(), reference.labels().end());
    t += 1 + static_cast<TimeNs>(random() % 2'000'000);
  }
  std::ranges::copy(camera.release_until(std::numeric_limits<TimeNs>::max()), std::back_inserter(fast.events));
  fast.labels.insert(fast.labels.end(), camera.labels().begin(), camera.labels().end());
  // The front end and the low-pass use floats, which limits the accuracy of times and parts. Thresholds with noise are
  // floats, too, and their rounding adds up in the references.
  const EventCameraOptions& o = GetParam();
  const bool in_floats = o.response != PixelResponse::log || o.low_pass_hz > 0 || o.surround_px > 0;
  const double tolerance_ns = in_floats ? 2000 : o.threshold_noise > 0 ? 200 : 1;
  const double tolerance = in_floats ? 1e-3 : o.threshold_noise > 0 ? 1e-5 : 1e-6;
  // With shot noise or dropped requests, rounding decides now and then which event comes next, or whether a request is
  // dropped, which moves the reference. From there on, a pixel goes another way, and is not compared.
  const bool goes_other_ways = o.shot_noise_hz > 0 || o.refractory_mode == RefractoryMode::drop;
  const auto by_pixel = [](const Explained& all) {
    std::map<std::pair<int, int>, std::vector<std::pair<EventLabel, int>>> pixels;
    for (std::size_t i = 0; i < all.events.size(); ++i)
      pixels[{all.events[i].x, all.events[i].y}].emplace_back(all.labels[i], all.events[i].polarity);
    for (auto& [pixel, labels] : pixels)
      std::ranges::stable_sort(labels, {}, [](const auto& label) { return label.first.t_ideal; });
    return pixels;
  };
  auto fast_pixels = by_pixel(fast);
  std::size_t compared = 0;
  for (const auto& [pixel, labels] : by_pixel(defined)) {
    const auto& found = fast_pixels[pixel];
    for (std::size_t i = 0; i < std::min(found.size(), labels.size()); ++i) {
      const auto& [a, polarity] = found[i];
      const auto& [b, expected_polarity] = labels[i];
      if (polarity != expected_polarity || std::abs(static_cast<double>(a.t_ideal - b.t_ideal)) > tolerance_ns) break;
      if (goes_other_ways && std::abs(a.signal - b.signal) > tolerance) break;
      ++compared;
      EXPECT_NEAR(a.signal, b.signal, tolerance);
      EXPECT_NEAR(a.noise, b.noise, tolerance);
      EXPECT_NEAR(a.leak, b.leak, tolerance);
      EXPECT_EQ(a.hot, b.hot);
      // Parts of equal size may be ordered by rounding.
      const auto differ = [&](float one, float other) { return std::abs(one - other) > tolerance; };
      const bool is_clear = differ(a.signal, a.noise) && differ(a.signal, a.leak) && differ(a.noise, a.leak);
      EXPECT_TRUE(!is_clear || a.cause == b.cause);
    }
  }
  EXPECT_GE(static_cast<double>(compared), (goes_other_ways ? 0.99 : 1.0) * static_cast<double>(defined.events.size()));
  EXPECT_GT(compared, 1000U);
}

INSTANTIATE_TEST_SUITE_P(SeparateEffects, LabelsAgainstReference, testing::ValuesIn(separate_effects()));

/// The fraction of the events that a cause has.
double fraction(const Explained& explained, EventCause cause) {
  EXPECT_FALSE(explained.events.empty());
  const auto count = std::ranges::count(explained.labels, cause, &EventLabel::cause);
  return static_cast<double>(count) / static_cast<double>(explained.labels.size());
}

const Light kDark = [](int, int, double) { return 0.0F; };
const Light kGrey = [](int, int, double) { return 0.5F; };

TEST(LabelCauses, OfADarkSceneAreNoise) {
  EXPECT_EQ(fraction(run({.shot_noise_hz = 100, .labels = true}, kDark, 100, 1), EventCause::noise), 1);
  EventCameraOptions options = dim_circuit();
  options.leak_rate_hz = options.hot_pixels = 0;
  const Explained explained = run(options, kDark, 100, 1);
  EXPECT_EQ(fraction(explained, EventCause::noise), 1);
  for (const EventLabel& label : explained.labels) EXPECT_EQ(label.signal, 0);
}

TEST(LabelCauses, OfALeakAreLeak) {
  const EventCameraOptions separate{
      .leak_rate_hz = 10, .leak_mismatch_decades = 0.1, .leak_jitter = 0.1, .labels = true};
  EXPECT_EQ(fraction(run(separate, kGrey, 100, 1), EventCause::leak), 1);
  EventCameraOptions circuit = dim_circuit();
  circuit.circuit->noise = 0;
  circuit.leak_rate_hz = 10;
  const Explained explained = run(circuit, kGrey, 100, 1);
  EXPECT_EQ(fraction(explained, EventCause::leak), 1);
  for (const EventLabel& label : explained.labels) EXPECT_NEAR(label.signal, 0, 1e-6);
  EXPECT_GT(std::ranges::count(explained.labels, 1, &EventLabel::hot), 0);
}

TEST(LabelCauses, OfMotionSeenByIdealPixelsAreTheSignal) {
  EXPECT_EQ(fraction(run({.contrast_threshold = 0.2, .labels = true}, waves, 500, 0.5), EventCause::signal), 1);
  EventCameraOptions circuit = dim_circuit();
  circuit.circuit->noise = 0;
  circuit.leak_rate_hz = circuit.hot_pixels = 0;
  EXPECT_EQ(fraction(run(circuit, waves, 500, 0.5), EventCause::signal), 1);
}

TEST(LabelCauses, TheSignalOfACircuitIsThatOfTheLight) {
  // A slow ramp of L = ln(E + dark): after the beginning, v = L - (T1 + T2) dL/dt up to terms of second order in
  // (T1 + T2) dL/dt, whatever the noise does (docs/methods/circuit.md). T1 falls as the light rises.
  EventCameraOptions options = dim_circuit();
  options.circuit->white_lux = 1000;
  options.refractory_period_us = 0;
  const double rate = 2, dark = options.circuit->dark_irradiance();
  const auto irradiance = [&](double t) { return 0.1 * std::exp(rate * t); };
  Explained explained = run(
      options, [&](int, int, double t) { return static_cast<float>(irradiance(t)); }, 500, 1);
  explained.sort();
  const double electron_fC = 1.602176634e-4;
  const double t1_unit = options.circuit->photodiode_charge_e * electron_fC / options.circuit->white_photocurrent_fa();
  const double t2 = 1 / (2 * std::numbers::pi * options.circuit->source_follower_hz);
  const auto slope = [&](double t) { return rate * irradiance(t) / (irradiance(t) + dark); };
  const auto lag = [&](double t) { return slope(t) * (t1_unit / (irradiance(t) + dark) + t2); };
  const auto v = [&](double t) { return std::log(irradiance(t) + dark) - lag(t); };
  std::size_t compared = 0;
  for (std::size_t i = 1; i < explained.events.size(); ++i) {
    const Event &before = explained.events[i - 1], &event = explained.events[i];
    if (before.x != event.x || before.y != event.y) continue;
    const double from = to_seconds(explained.labels[i - 1].t_ideal), to = to_seconds(explained.labels[i].t_ideal);
    if (from < 0.1) continue;
    const double second_order = lag(from) * lag(from);
    EXPECT_NEAR(explained.labels[i].signal, v(to) - v(from), 4 * second_order + 1e-6);
    ++compared;
  }
  EXPECT_GT(compared, 1000U);
}

TEST(LabelCauses, OfHotPixelsAreMarked) {
  const Explained explained = run({.hot_pixels = 0.1, .hot_pixel_rate_hz = 50, .labels = true}, kGrey, 100, 1);
  EXPECT_EQ(fraction(explained, EventCause::leak), 1);
  for (const EventLabel& label : explained.labels) EXPECT_EQ(label.hot, 1);
}

TEST(LabelTimes, AreThoseOfTheIdealSensor) {
  // Latency and readout delay the stamps only.
  const EventCameraOptions ideal{.contrast_threshold = 0.2, .labels = true};
  EventCameraOptions late = ideal;
  late.latency_us = 700;
  Explained expected = run(ideal, waves, 500, 0.3), delayed = run(late, waves, 500, 0.31);
  expected.sort(), delayed.sort();
  std::map<std::tuple<int, int>, std::vector<TimeNs>> times;
  for (std::size_t i = 0; i < delayed.events.size(); ++i) {
    EXPECT_EQ(delayed.events[i].t - delayed.labels[i].t_ideal, 700'000);
    times[{delayed.events[i].x, delayed.events[i].y}].push_back(delayed.labels[i].t_ideal);
  }
  for (std::size_t i = 0; i < expected.events.size(); ++i) {
    EXPECT_EQ(expected.labels[i].t_ideal, expected.events[i].t);
    const auto& pixel = times[{expected.events[i].x, expected.events[i].y}];
    EXPECT_TRUE(std::ranges::binary_search(pixel, expected.events[i].t));
  }
}

}  // namespace
}  // namespace esim
