// Rates and distributions of the random effects, compared with their formulae.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "event_camera/feed.h"

namespace esim {
namespace {

using test::Feed;

constexpr int kWidth = 100, kHeight = 60;
constexpr double kPixels = kWidth * kHeight;

/// The events at constant irradiance, sampled `samples` times.
std::vector<Event> in_constant_light(const EventCameraOptions& options, double light, double duration_s,
                                     int samples = 50) {
  Feed feed(options, kWidth, kHeight, 21);
  const Image<float> frame(kWidth, kHeight, static_cast<float>(light));
  for (int k = 0; k <= samples; ++k) feed.frame(frame, to_ns(duration_s) * k / samples);
  return feed.events(to_ns(duration_s));
}

std::map<int, std::vector<double>> times_by_pixel(const std::vector<Event>& events) {
  std::map<int, std::vector<double>> times;
  for (const Event& event : events) times[event.y * kWidth + event.x].push_back(to_seconds(event.t));
  return times;
}

struct Moments {
  double mean = 0, variance = 0;
  explicit Moments(const std::vector<double>& values) {
    for (const double v : values) mean += v / static_cast<double>(values.size());
    for (const double v : values) variance += (v - mean) * (v - mean) / static_cast<double>(values.size());
  }
};

TEST(PixelNoise, AnIdealPixelIsSilentInConstantLight) { EXPECT_TRUE(in_constant_light({}, 0.3, 100).empty()); }

TEST(PixelNoise, LeakEventsHaveTheGivenRateAndJitter) {
  for (const int samples : {1, 500}) {
    for (const double low_pass_hz : {0.0, 100.0}) {
      EventCameraOptions options;
      options.low_pass_hz = low_pass_hz;
      options.leak_rate_hz = 5;
      options.leak_jitter = 0.1;
      const std::vector<Event> events = in_constant_light(options, 0.3, 4, samples);
      // Pixels start at a random time between two events, so that the mean number per pixel is rate * time.
      const double expected = 5 * 4 * kPixels;
      EXPECT_NEAR(static_cast<double>(events.size()), expected, 5 * 0.5 * std::sqrt(kPixels));
      EXPECT_TRUE(std::all_of(events.begin(), events.end(), [](const Event& e) { return e.polarity == 1; }));
      std::vector<double> intervals, first;
      for (const auto& [pixel, times] : times_by_pixel(events)) {
        for (std::size_t i = 1; i < times.size(); ++i) intervals.push_back(times[i] - times[i - 1]);
        first.push_back(times[0]);
      }
      const Moments moments(intervals);
      const auto n = static_cast<double>(intervals.size());
      EXPECT_NEAR(moments.mean, 0.2, 5 * 0.02 / std::sqrt(n) + 0.02 * 0.02);  // the last, long intervals are cut off
      EXPECT_NEAR(std::sqrt(moments.variance), 0.02, 0.02 * 5 / std::sqrt(2 * n) + 1e-4);
      EXPECT_NEAR(Moments(first).mean, 0.1, 5 * 0.2 / std::sqrt(12 * kPixels) + 0.001);
    }
  }
}

TEST(PixelNoise, LeakRatesDifferAsGivenFromPixelToPixel) {
  EventCameraOptions options;
  options.leak_rate_hz = 20;
  options.leak_mismatch_decades = 0.2;
  std::vector<double> decades;
  for (const auto& [pixel, times] : times_by_pixel(in_constant_light(options, 0.3, 10))) {
    const double rate = static_cast<double>(times.size() - 1) / (times.back() - times.front());
    decades.push_back(std::log10(rate / 20));
  }
  ASSERT_EQ(decades.size(), static_cast<std::size_t>(kPixels));
  EXPECT_NEAR(Moments(decades).mean, 0, 5 * 0.2 / std::sqrt(kPixels));
  EXPECT_NEAR(std::sqrt(Moments(decades).variance), 0.2, 5 * 0.2 / std::sqrt(2 * kPixels));
}

TEST(PixelNoise, ShotNoiseIsAPoissonProcessWhoseRateGoesWithTheLight) {
  constexpr double kRate = 10, kDuration = 4, kDark = 20.0 / 255;
  for (const double light : {0.0, 0.5, 1.0, 7.0}) {
    for (const int samples : {1, 400}) {
      EventCameraOptions options;
      options.shot_noise_hz = kRate;
      const std::vector<Event> events = in_constant_light(options, light, kDuration, samples);
      const double intensity = std::min((light + kDark) / (1 + kDark), 1.0);
      const double rate = kRate * (1 - 0.75 * intensity), expected = rate * kDuration * kPixels;
      EXPECT_NEAR(static_cast<double>(events.size()), expected, 5 * std::sqrt(expected)) << light;
      const auto on = std::count_if(events.begin(), events.end(), [](const Event& e) { return e.polarity > 0; });
      EXPECT_NEAR(static_cast<double>(on), expected / 2, 5 * std::sqrt(expected / 2));

      // Counts per pixel have variance = mean; the fourth moment gives the standard deviation of the variance.
      std::vector<double> counts(static_cast<std::size_t>(kPixels), 0.0), intervals;
      for (const auto& [pixel, times] : times_by_pixel(events)) {
        counts[static_cast<std::size_t>(pixel)] = static_cast<double>(times.size());
        for (std::size_t i = 1; i < times.size(); ++i) intervals.push_back(times[i] - times[i - 1]);
      }
      const double mean = rate * kDuration;
      EXPECT_NEAR(Moments(counts).variance, mean, 5 * std::sqrt((mean + 2 * mean * mean) / kPixels)) << light;
      // Times are uniform: their mean is the middle.
      double sum = 0;
      for (const Event& event : events) sum += to_seconds(event.t);
      EXPECT_NEAR(sum / static_cast<double>(events.size()), kDuration / 2, 5 * kDuration / std::sqrt(12 * expected));
    }
  }
}

TEST(PixelNoise, IntervalsOfShotNoiseAreExponential) {
  EventCameraOptions options;
  options.shot_noise_hz = 200;
  options.shot_noise_at_white = 1;
  std::vector<double> intervals;
  for (const auto& [pixel, times] : times_by_pixel(in_constant_light(options, 0.4, 1))) {
    for (std::size_t i = 1; i < std::min<std::size_t>(times.size(), 60); ++i)
      intervals.push_back(times[i] - times[i - 1]);
  }
  // Kolmogorov-Smirnov test at the level of 1e-3.
  std::sort(intervals.begin(), intervals.end());
  const auto n = static_cast<double>(intervals.size());
  double distance = 0;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const double cdf = 1 - std::exp(-200 * intervals[i]);
    distance = std::max({distance, cdf - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - cdf});
  }
  EXPECT_LT(distance, 1.95 / std::sqrt(n));
}

TEST(PixelNoise, ShotNoiseIsBlindInTheRefractoryPeriod) {
  EventCameraOptions options;
  options.shot_noise_hz = 400;
  options.shot_noise_at_white = 1;
  options.refractory_period_us = 2000;
  const std::vector<Event> events = in_constant_light(options, 0.4, 1);
  const double expected = kPixels / (1.0 / 400 + 0.002);  // a renewal process: dead time and waiting time
  EXPECT_NEAR(static_cast<double>(events.size()), expected, 0.01 * expected);
  for (const auto& [pixel, times] : times_by_pixel(events)) {
    for (std::size_t i = 1; i < times.size(); ++i) ASSERT_GE(times[i] - times[i - 1], 0.002 - 1e-12);
  }
}

TEST(PixelNoise, SomePixelsAreHotAndSomeAreDead) {
  EventCameraOptions options;
  options.contrast_threshold = 0.2;
  options.hot_pixels = 0.02;
  options.hot_pixel_rate_hz = 50;
  options.dead_pixels = 0.05;
  Feed feed(options, kWidth, kHeight, 5);
  feed.frame(Image<float>(kWidth, kHeight, 0.2F), 0);
  feed.frame(Image<float>(kWidth, kHeight, 0.2F), kNsPerSecond);
  const auto hot = times_by_pixel(feed.events(kNsPerSecond));
  EXPECT_NEAR(static_cast<double>(hot.size()), 0.02 * kPixels, 5 * std::sqrt(0.02 * kPixels));
  for (const auto& [pixel, times] : hot) EXPECT_NEAR(static_cast<double>(times.size()), 50, 1);
  feed.frame(Image<float>(kWidth, kHeight, 0.8F), 2 * kNsPerSecond);
  const auto alive = times_by_pixel(feed.events(2 * kNsPerSecond));
  EXPECT_NEAR(static_cast<double>(alive.size()), 0.95 * kPixels, 5 * std::sqrt(0.05 * kPixels));
}

TEST(PixelNoise, DeadPixelsAreSilentWhateverTheNoise) {
  EventCameraOptions options;
  options.contrast_threshold = 0.1;
  options.threshold_noise = 0.02;
  options.shot_noise_hz = 100;
  options.leak_rate_hz = 50;
  options.hot_pixels = 0.2;
  options.dead_pixels = 1;
  for (const double low_pass_hz : {0.0, 100.0}) {
    options.low_pass_hz = low_pass_hz;
    Feed feed(options, kWidth, kHeight, 5);
    for (int k = 0; k < 10; ++k)
      feed.frame(Image<float>(kWidth, kHeight, k % 2 == 0 ? 0.1F : 0.9F), k * 100 * kNsPerMs);
    EXPECT_TRUE(feed.events().empty());
  }
}

TEST(PixelNoise, LatencyHasTheGivenMeanAndSpreadAndGoesWithTheLight) {
  constexpr double kDark = 20.0 / 255;
  for (const double share : {0.0, 0.6}) {
    for (const double light : {0.05, 1.0}) {
      EventCameraOptions options;
      options.contrast_threshold = 0.3;
      options.latency_us = 100;
      options.latency_jitter_us = 10;
      options.latency_light_share = share;
      Feed feed(options, kWidth, kHeight, 8);
      // A slow ramp through a single level, at the same time in all pixels.
      const double eps = options.log_eps;
      const auto at = [&](double b) { return static_cast<float>((light + eps) * std::exp(b) - eps); };
      feed.frame(Image<float>(kWidth, kHeight, at(-0.305)), 0);
      feed.frame(Image<float>(kWidth, kHeight, at(0.0)), 100 * kNsPerMs);
      feed.frame(Image<float>(kWidth, kHeight, at(0.0)), 200 * kNsPerMs);
      const std::vector<Event> events = feed.events(200 * kNsPerMs);
      ASSERT_EQ(events.size(), static_cast<std::size_t>(kPixels));
      const double crossing_s = 0.1 * 0.3 / 0.305;
      const double factor = 1 - share + share * (1 + kDark) / (light + kDark);
      std::vector<double> delays;
      for (const Event& event : events) delays.push_back((to_seconds(event.t) - crossing_s) * 1e6);
      // The irradiance at the crossing is within 0.6 % of that at the end.
      EXPECT_NEAR(Moments(delays).mean, 100 * factor, 5 * 10 * factor / std::sqrt(kPixels) + 0.6 * factor);
      EXPECT_NEAR(std::sqrt(Moments(delays).variance), 10 * factor, 0.6 * factor);
    }
  }
}

/// Sinusoids with different frequency, phase, amplitude and mean in each pixel.
Image<float> flicker(double t_s, int width, int height) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double hz = 1 + 0.2 * x, phase = 0.37 * y * x, amplitude = 0.4 + 0.01 * y;
      image(x, y) = static_cast<float>(std::exp(amplitude * std::sin(6.283185307 * hz * t_s + phase) - 0.03 * y));
    }
  }
  return image;
}

struct Effect {
  const char* name;
  EventCameraOptions options;
};

std::vector<Effect> effects() {
  std::vector<Effect> all = {{"ideal", {}},      {"mismatch", {}}, {"noise", {}},     {"refractory", {}},
                             {"drop", {}},       {"low_pass", {}}, {"two poles", {}}, {"leak", {}},
                             {"shot noise", {}}, {"lin_log", {}},  {"everything", {}}};
  for (Effect& effect : all) {
    EventCameraOptions& o = effect.options;
    const std::string name = effect.name;
    const bool everything = name == "everything";
    o.contrast_threshold = 0.15;
    if (name == "mismatch" || everything) o.threshold_mismatch = 0.03;
    if (name == "noise" || everything) o.threshold_noise = 0.03;
    if (name == "refractory" || name == "drop" || everything) o.refractory_period_us = 3000;
    if (name == "drop") o.refractory_mode = RefractoryMode::drop;
    if (name == "low_pass" || everything) o.low_pass_hz = 30;
    if (name == "two poles") o.low_pass_hz = 30, o.low_pass_order = 2;
    if (name == "leak" || everything) o.leak_rate_hz = 4, o.leak_jitter = 0.2, o.leak_mismatch_decades = 0.1;
    if (name == "shot noise" || everything) o.shot_noise_hz = 10;
    if (name == "lin_log") o.response = PixelResponse::lin_log;
    if (everything) o.hot_pixels = o.dead_pixels = 0.01, o.latency_us = 50, o.latency_jitter_us = 10;
  }
  return all;
}

TEST(PixelNoise, DoesNotDependOnHowDenselyTheSignalIsSampled) {
  constexpr double kDuration = 0.3;
  constexpr int kColumns = 50, kRows = 24;
  const std::vector<Effect> all = effects();
  std::vector<std::vector<double>> counts(all.size());
  for (const int rate_hz : {1000, 5000, 20000}) {
    std::vector<Feed> feeds;
    std::vector<std::size_t> events(all.size(), 0);
    for (const Effect& effect : all) feeds.emplace_back(effect.options, kColumns, kRows, 4);
    for (int k = 0; k <= kDuration * rate_hz; ++k) {
      const TimeNs t = kNsPerSecond / rate_hz * k;
      const Image<float> frame = flicker(to_seconds(t), kColumns, kRows);
      for (std::size_t i = 0; i < all.size(); ++i) {
        feeds[i].frame(frame, t);
        events[i] += feeds[i].events(t).size();
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i) counts[i].push_back(static_cast<double>(events[i]));
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_GT(counts[i][2], 4000) << all[i].name;
    EXPECT_NEAR(counts[i][0] / counts[i][2], 1, 0.005) << all[i].name;
    EXPECT_NEAR(counts[i][1] / counts[i][2], 1, 0.005) << all[i].name;
  }
}

}  // namespace
}  // namespace esim
