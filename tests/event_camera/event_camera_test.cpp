#include "esim/event_camera/event_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>

#include "esim/core/error.h"
#include "esim/event_camera/reference.h"
#include "event_camera/feed.h"
#include "support/errors.h"

namespace esim {
namespace {

using test::Feed;

Image<float> uniform_image(double brightness, double log_eps) {
  return Image<float>(1, 1, static_cast<float>(std::exp(brightness) - log_eps));
}

/// A random walk of the log-irradiance of each pixel, with steps of very different sizes.
std::vector<Image<float>> random_frames(int width, int height, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<Image<float>> frames(1, Image<float>(width, height, 0.3F));
  while (static_cast<int>(frames.size()) < count) {
    Image<float> next = frames.back();
    for (float& value : next.pixels()) {
      const float step = random() % 4 == 0 ? 1.5F : 0.1F;
      value = std::clamp(value * std::exp(step * normal(random)), 0.0F, 50.0F);
      if (random() % 50 == 0) value = 0;
    }
    frames.push_back(next);
  }
  return frames;
}

/// Every effect at once, except the readout.
EventCameraOptions everything(int low_pass_order, RefractoryMode refractory_mode) {
  return {.contrast_threshold = 0.2,
          .contrast_threshold_off = 0.3,
          .threshold_mismatch = 0.05,
          .threshold_noise = 0.02,
          .low_pass_hz = 500,
          .low_pass_order = low_pass_order,
          .surround_px = 2,
          .surround_ms = 3,
          .refractory_period_us = 300,
          .refractory_mode = refractory_mode,
          .leak_rate_hz = 20,
          .leak_mismatch_decades = 0.1,
          .leak_jitter = 0.1,
          .shot_noise_hz = 50,
          .hot_pixels = 0.02,
          .dead_pixels = 0.02,
          .latency_us = 200,
          .latency_jitter_us = 60,
          .latency_light_share = 0.7};
}

class EventCameraAgainstReference : public testing::TestWithParam<EventCameraOptions> {};

/// Expects the same events of each pixel, with times equal within the tolerance.
void expect_same(std::vector<Event> events, std::vector<Event> expected, TimeNs tolerance_ns) {
  const auto by_pixel = [](const Event& a, const Event& b) {
    return std::tie(a.y, a.x, a.t, a.polarity) < std::tie(b.y, b.x, b.t, b.polarity);
  };
  std::sort(events.begin(), events.end(), by_pixel);
  std::sort(expected.begin(), expected.end(), by_pixel);
  ASSERT_EQ(events.size(), expected.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    ASSERT_EQ(std::tie(events[i].y, events[i].x, events[i].polarity),
              std::tie(expected[i].y, expected[i].x, expected[i].polarity))
        << "at t = " << events[i].t << " and " << expected[i].t;
    ASSERT_NEAR(static_cast<double>(events[i].t), static_cast<double>(expected[i].t),
                static_cast<double>(tolerance_ns));
  }
}

TEST_P(EventCameraAgainstReference, FiresTheSameEvents) {
  const EventCameraOptions& options = GetParam();
  const int odd = options.surround_px > 0 ? 0 : 1;  // the surround requires even sizes
  const int width = 36 + odd, height = 10 + odd;
  const std::vector<Image<float>> frames = random_frames(width, height, 60, 5);
  Feed fast(options, width, height, 9);
  ReferenceEventCamera reference(options, width, height, 9, 0);
  std::mt19937 random(3);
  TimeNs t = -1000;
  std::vector<Event> expected;
  for (const Image<float>& frame : frames) {
    fast.frame(frame, t);
    for (const Event& event : reference.process(frame, t)) expected.push_back(event);
    t += 1 + static_cast<TimeNs>(random() % 2'000'000);
  }
  const std::vector<Event> events = fast.events();
  EXPECT_TRUE(std::is_sorted(events.begin(), events.end()));
  EXPECT_GT(events.size(), 1000U);
  // The front end and the low-pass use floats, which limits the accuracy of times.
  const bool in_floats = options.response != PixelResponse::log || options.low_pass_hz > 0 || options.surround_px > 0;
  expect_same(events, expected, in_floats ? 2000 : 1);
}

INSTANTIATE_TEST_SUITE_P(
    Options, EventCameraAgainstReference,
    testing::Values(
        EventCameraOptions{}, EventCameraOptions{.contrast_threshold = 0.05},
        EventCameraOptions{.contrast_threshold_on = 0.2, .contrast_threshold_off = 0.7},
        EventCameraOptions{.contrast_threshold = 0.3, .threshold_mismatch = 0.2},
        EventCameraOptions{.contrast_threshold = 0.3, .threshold_noise = 0.15},
        EventCameraOptions{
            .contrast_threshold = 0.2, .threshold_mismatch = 0.05, .threshold_noise = 0.1, .refractory_period_us = 300},
        EventCameraOptions{.contrast_threshold = 0.1, .log_eps = 1e-5, .refractory_period_us = 5000},
        EventCameraOptions{.contrast_threshold = 0.2, .threshold_mismatch = 0.03, .refractory_period_us = 1},
        EventCameraOptions{
            .contrast_threshold = 0.1, .refractory_period_us = 400, .refractory_mode = RefractoryMode::drop},
        EventCameraOptions{.contrast_threshold = 0.5, .leak_rate_hz = 300},
        EventCameraOptions{.contrast_threshold = 0.5,
                           .refractory_period_us = 200,
                           .leak_rate_hz = 100,
                           .leak_mismatch_decades = 0.3,
                           .leak_jitter = 0.2},
        EventCameraOptions{.contrast_threshold = 0.4, .refractory_period_us = 900, .shot_noise_hz = 1000},
        EventCameraOptions{.shot_noise_hz = 500, .shot_noise_at_white = 0.9, .hot_pixels = 0.1, .dead_pixels = 0.2},
        EventCameraOptions{.contrast_threshold = 0.3,
                           .threshold_mismatch = 0.05,
                           .threshold_noise = 0.02,
                           .refractory_period_us = 50,
                           .leak_rate_hz = 20,
                           .leak_mismatch_decades = 0.1,
                           .leak_jitter = 0.1,
                           .shot_noise_hz = 50,
                           .hot_pixels = 0.02,
                           .dead_pixels = 0.02,
                           .latency_us = 200,
                           .latency_jitter_us = 60,
                           .latency_light_share = 0.7},
        EventCameraOptions{.contrast_threshold = 0.2, .response = PixelResponse::lin_log},
        EventCameraOptions{.contrast_threshold = 0.3,
                           .threshold_noise = 0.02,
                           .response = PixelResponse::lin_log,
                           .leak_rate_hz = 100,
                           .shot_noise_hz = 300},
        EventCameraOptions{.contrast_threshold = 0.2, .low_pass_hz = 300},
        EventCameraOptions{.contrast_threshold = 0.2, .low_pass_hz = 300, .low_pass_order = 2},
        EventCameraOptions{.contrast_threshold = 0.2, .surround_px = 2, .surround_ms = 3},
        everything(1, RefractoryMode::hold), everything(2, RefractoryMode::hold), everything(1, RefractoryMode::drop),
        everything(2, RefractoryMode::drop)));

TEST(EventCamera, TheFirstFrameFiresNothing) {
  Feed feed({}, 4, 4);
  feed.frame(Image<float>(4, 4, 7.0F), 100);
  EXPECT_TRUE(feed.events().empty());
}

TEST(EventCamera, ARampFiresAtItsLevels) {
  // L rises by 100 per second and then falls: events every C / 100 s, up to the rounding of float irradiance.
  const EventCameraOptions options{.contrast_threshold_on = 0.3, .contrast_threshold_off = 0.2};
  Feed feed(options, 1, 1);
  constexpr double kSlope = 100;
  for (int k = 0; k <= 20; ++k) feed.frame(uniform_image(-1 + kSlope * k * 1e-3, options.log_eps), k * kNsPerMs);
  for (int k = 1; k <= 20; ++k) feed.frame(uniform_image(1 - kSlope * k * 1e-3, options.log_eps), (20 + k) * kNsPerMs);

  const std::vector<Event> events = feed.events();
  ASSERT_EQ(events.size(), 6U + 9U);  // up by 2.0 = 6 * 0.3 + 0.2; down from 1.8 above the start: 9 * 0.2, then 0.0
  for (std::size_t i = 0; i < events.size(); ++i) {
    const double expected_s =
        i < 6 ? 0.3 * static_cast<double>(i + 1) / kSlope : 0.020 + (0.2 + 0.2 * static_cast<double>(i - 5)) / kSlope;
    EXPECT_NEAR(static_cast<double>(events[i].t), expected_s * 1e9, 5) << i;
    EXPECT_EQ(events[i].polarity, i < 6 ? 1 : -1);
  }
}

TEST(EventCamera, FiresWithinANanosecondOfItsLevels) {
  // One slow segment of one second, for several thresholds, with the irradiance of the floats.
  for (const double threshold : {0.013, 0.1, 0.3}) {
    for (const bool rises : {true, false}) {
      const EventCameraOptions options{.contrast_threshold = threshold};
      Feed feed(options, 1, 1);
      const float first = rises ? 0.02F : 0.93F, last = rises ? 0.93F : 0.02F;
      feed.frame(Image<float>(1, 1, first), 0);
      feed.frame(Image<float>(1, 1, last), kNsPerSecond);
      const double span = std::fabs(std::log((last + options.log_eps) / (first + options.log_eps)));
      const std::vector<Event> events = feed.events();
      ASSERT_EQ(events.size(), static_cast<std::size_t>(span / threshold));
      for (std::size_t k = 0; k < events.size(); ++k) {
        EXPECT_NEAR(static_cast<double>(events[k].t), 1e9 * threshold * static_cast<double>(k + 1) / span, 1);
        EXPECT_EQ(events[k].polarity, rises ? 1 : -1);
      }
    }
  }
}

TEST(EventCamera, DoesNotDependOnHowDenselyALineIsSampled) {
  const EventCameraOptions options{.contrast_threshold = 0.13, .threshold_noise = 0.05, .refractory_period_us = 700};
  std::vector<std::vector<Event>> results;
  for (const int samples : {1, 7, 1000}) {
    Feed feed(options, 1, 1, 4);
    for (int k = 0; k <= samples; ++k) {
      feed.frame(uniform_image(3.0 * k / samples, options.log_eps), 100 * kNsPerMs * k / samples);
    }
    results.push_back(feed.events());
  }
  ASSERT_GT(results[0].size(), 10U);
  for (const auto& events : results) {
    ASSERT_EQ(events.size(), results[0].size());
    for (std::size_t i = 0; i < events.size(); ++i)
      EXPECT_NEAR(static_cast<double>(events[i].t), static_cast<double>(results[0][i].t), 50);
  }
}

TEST(EventCamera, TilesGiveTheSameAsTheWholeImage) {
  const EventCameraOptions options{
      .contrast_threshold = 0.2, .threshold_mismatch = 0.03, .threshold_noise = 0.02, .refractory_period_us = 100};
  const std::vector<Tile> tiles = {{20, 0, 17, 11}, {0, 5, 20, 6}, {0, 0, 20, 5}};
  Feed whole(options, 37, 11), tiled(options, 37, 11);
  TimeNs t = 0;
  for (const Image<float>& frame : random_frames(37, 11, 20, 8)) {
    whole.frame(frame, t);
    tiled.feed(frame, t, tiles);
    t += kNsPerMs;
  }
  const std::vector<Event> events = whole.events();
  EXPECT_GT(events.size(), 1000U);
  EXPECT_EQ(tiled.events(), events);
}

TEST(EventCamera, DoesNotDependOnTheNumberOfThreads) {
  const EventCameraOptions options{.contrast_threshold = 0.2, .threshold_mismatch = 0.03, .threshold_noise = 0.02};
  const Workers two(2), five(5);
  Feed a(options, 64, 48), b(options, 64, 48), c(options, 64, 48);
  TimeNs t = 0;
  for (const Image<float>& frame : random_frames(64, 48, 10, 2)) {
    a.frame(frame, t);
    b.frame(frame, t, two);
    c.frame(frame, t, five);
    t += kNsPerMs;
  }
  const std::vector<Event> events = a.events();
  EXPECT_EQ(b.events(), events);
  EXPECT_EQ(c.events(), events);
}

TEST(EventCamera, HoldsThePixelForTheRefractoryPeriod) {
  const EventCameraOptions options{.contrast_threshold = 0.1, .refractory_period_us = 1000};
  Feed feed(options, 1, 1);
  // 1 per second: one level every 100 ms. Then 1000 per second: one event, reset for 1 ms, and a new reference.
  feed.frame(uniform_image(0, options.log_eps), 0);
  feed.frame(uniform_image(1000 * 0.010, options.log_eps), 10 * kNsPerMs);
  const std::vector<Event> events = feed.events();
  ASSERT_EQ(events.size(), 9U);  // every 0.1 ms + 1 ms: 0.1, 1.2, 2.3, ... 8.9 ms
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(events[i].t), 1e6 * (0.1 + 1.1 * static_cast<double>(i)), 5);
  }
}

TEST(EventCamera, ThresholdsHaveTheGivenMeanAndSpread) {
  // On a ramp of 1 per second the time in s between a pixel's events is its threshold.
  constexpr int kWidth = 100, kHeight = 40;
  constexpr double kMean = 0.2, kMismatch = 0.02, kNoise = 0.015;
  const EventCameraOptions options{
      .contrast_threshold = kMean, .threshold_mismatch = kMismatch, .threshold_noise = kNoise};
  Feed feed(options, kWidth, kHeight, 17);
  for (int k = 0; k <= 10; ++k) {
    feed.frame(Image<float>(kWidth, kHeight, static_cast<float>(std::exp(0.42 * k) - options.log_eps)),
               k * 420 * kNsPerMs);
  }
  Image<double> last(kWidth, kHeight, 0.0), sum(kWidth, kHeight, 0.0), sum2(kWidth, kHeight, 0.0),
      count(kWidth, kHeight, 0.0);
  for (const Event& event : feed.events()) {
    const double interval = to_seconds(event.t) - last(event.x, event.y);
    last(event.x, event.y) = to_seconds(event.t);
    sum(event.x, event.y) += interval, sum2(event.x, event.y) += interval * interval, count(event.x, event.y) += 1;
  }
  double mean = 0, mean2 = 0, within = 0, freedom = 0;
  const double pixels = kWidth * kHeight;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double n = count(x, y), m = sum(x, y) / n;
      mean += m / pixels, mean2 += m * m / pixels;
      within += sum2(x, y) - n * m * m, freedom += n - 1;
    }
  }
  const double events_per_pixel = freedom / pixels + 1;
  const double between = mean2 - mean * mean - kNoise * kNoise / events_per_pixel;
  EXPECT_NEAR(mean, kMean, 5 * std::sqrt((kMismatch * kMismatch + kNoise * kNoise / events_per_pixel) / pixels));
  EXPECT_NEAR(std::sqrt(within / freedom), kNoise, 5 * kNoise / std::sqrt(2 * freedom));
  EXPECT_NEAR(std::sqrt(between), kMismatch, 6 * kMismatch / std::sqrt(2 * pixels));
}

TEST(EventCamera, OnAndOffMismatchAreIndependent) {
  constexpr int kPixels = 4000;
  const EventCameraOptions options{.contrast_threshold = 0.5, .threshold_mismatch = 0.05};
  Feed feed(options, kPixels, 1, 3);
  const auto at = [&](double brightness) {
    return Image<float>(kPixels, 1, static_cast<float>(std::exp(brightness) - options.log_eps));
  };
  feed.frame(at(0), 0);
  feed.frame(at(0.9), 900 * kNsPerMs);  // each pixel's ON threshold is the time of its event
  feed.frame(at(-0.9), 2700 * kNsPerMs);
  std::vector<double> on(kPixels), off(kPixels);
  for (const Event& event : feed.events()) {
    if (event.polarity > 0) on[event.x] = to_seconds(event.t);
    if (event.polarity < 0 && off[event.x] == 0) off[event.x] = on[event.x] - (0.9 - (to_seconds(event.t) - 0.9));
  }
  double product = 0, spread_on = 0, spread_off = 0;
  for (int i = 0; i < kPixels; ++i) {
    const double a = on[static_cast<std::size_t>(i)] - 0.5, b = off[static_cast<std::size_t>(i)] - 0.5;
    product += a * b, spread_on += a * a, spread_off += b * b;
  }
  EXPECT_NEAR(product / std::sqrt(spread_on * spread_off), 0.0, 5 / std::sqrt(kPixels));
  EXPECT_NEAR(std::sqrt(spread_off / kPixels), 0.05, 5 * 0.05 / std::sqrt(2.0 * kPixels));
}

TEST(EventCamera, RefusesWhatIsNoIrradiance) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -0.5F}) {
    for (const bool in_first_frame : {true, false}) {
      Feed feed({}, 40, 3);
      Image<float> good(40, 3, 0.5F), broken = good;
      broken(33, 2) = bad;
      if (!in_first_frame) feed.frame(good, 0);
      const std::string message = test::message_of<UserError>([&] { feed.frame(broken, 1500 * kNsPerMs); });
      EXPECT_TRUE(test::contains(message, "(33, 2)")) << message;
      EXPECT_TRUE(test::contains(message, "1.5")) << message;
    }
  }
}

/// A texture of waves that moves to the right by half a pixel per frame.
Image<float> moving_waves(int width, int height, int frame) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> uniform;
  Image<double> brightness(width, height, -1.0);
  for (int wave = 0; wave < 24; ++wave) {
    const double angle = 6.283 * uniform(random), length = 9 + 40 * uniform(random), phase = 6.283 * uniform(random);
    const double kx = 6.283185307 / length * std::cos(angle), ky = 6.283185307 / length * std::sin(angle);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) brightness(x, y) += 0.25 * std::sin(kx * (x - 0.5 * frame) + ky * y + phase);
    }
  }
  Image<float> image(width, height);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = static_cast<float>(std::exp(brightness.data()[i]));
  return image;
}

TEST(EventCamera, TimeStampsDoNotBandAtTheFrames) {
  constexpr int kWidth = 64, kHeight = 48, kFrames = 120, kBins = 20;
  const EventCameraOptions options{.contrast_threshold = 0.15, .threshold_mismatch = 0.03};
  Feed feed(options, kWidth, kHeight, 2);
  for (int k = 0; k < kFrames; ++k) feed.frame(moving_waves(kWidth, kHeight, k), k * kNsPerMs);
  std::vector<double> bins(kBins, 0.0);
  double count = 0;
  // Neighbours see the same edge: the number of independent events is much smaller.
  std::mt19937 random(1);
  for (const Event& event : feed.events()) {
    if (random() % 5 != 0 || event.t < 20 * kNsPerMs) continue;
    bins[static_cast<std::size_t>(event.t % kNsPerMs * kBins / kNsPerMs)] += 1;
    ++count;
  }
  ASSERT_GT(count, 4000);
  double chi2 = 0;
  for (const double n : bins) chi2 += (n - count / kBins) * (n - count / kBins) / (count / kBins);
  EXPECT_LT(chi2, 43.8);  // p = 0.001 with 19 degrees of freedom
}

TEST(EventCamera, TakesFramesChunkByChunk) {
  const EventCameraOptions options{.contrast_threshold = 0.2, .threshold_noise = 0.02, .refractory_period_us = 50};
  Feed feed(options, 37, 11, 3);
  EventCamera camera(options, 37, 11, 3), of_memory(options, 37, 11, 3);
  std::vector<Event> events, same;
  TimeNs t = 5;
  for (const Image<float>& frame : random_frames(37, 11, 20, 8)) {
    feed.frame(frame, t);
    camera.process(frame, t, events, test::kOneThread);
    of_memory.process(frame.pixels(), t, same, test::kOneThread);
    t += kNsPerMs;
  }
  EXPECT_GT(events.size(), 1000U);
  EXPECT_EQ(events, same);
  EXPECT_EQ(events, feed.events(t));
}

TEST(EventCamera, RefusesAFrameAndGoesOnAsIfItHadNotBeen) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (const bool filtered : {false, true}) {
    EventCameraOptions options{.contrast_threshold = 0.2};
    if (filtered) options.low_pass_hz = 100;
    EventCamera camera(options, 16, 12), undisturbed(options, 16, 12);
    const std::vector<Image<float>> frames = random_frames(16, 12, 10, 4);
    std::vector<Event> events, expected;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const TimeNs t = static_cast<TimeNs>(k) * kNsPerMs;
      camera.process(frames[k], t, events, test::kOneThread);
      undisturbed.process(frames[k], t, expected, test::kOneThread);
      const auto refusal = [&](const Image<float>& frame, TimeNs at) {
        return test::message_of<UserError>([&] { camera.process(frame, at, events, test::kOneThread); });
      };
      const std::string name = "frame " + std::to_string(k + 1) + ":";
      for (const float bad : {kNan, kInf, -kInf, -1e-9F, -1.0F}) {
        Image<float> broken = frames[k];
        broken(15, 7) = bad;
        const std::string message = refusal(broken, t + 1000);
        EXPECT_TRUE(test::contains(message, name)) << message;
        EXPECT_TRUE(test::contains(message, "(15, 7)")) << message;
      }
      EXPECT_TRUE(test::contains(refusal(Image<float>(12, 16, 1.0F), t + 1000), name));
      EXPECT_TRUE(test::contains(refusal(Image<float>(), t + 1000), "0 x 0"));
      EXPECT_TRUE(test::contains(refusal(frames[k], t), "does not come after"));
      EXPECT_TRUE(test::contains(refusal(frames[k], t - 5), name));
    }
    EXPECT_EQ(events, expected);
    EXPECT_GT(events.size(), 100U);
  }
}

TEST(EventCamera, KeepsEventsBeforeABadSegment) {
  Feed feed({}, 40, 3);
  feed.frame(Image<float>(40, 3, 0.1F), 0);
  feed.frame(Image<float>(40, 3, 0.9F), kNsPerMs);
  EXPECT_THROW(feed.frame(Image<float>(40, 3, -1.0F), 2 * kNsPerMs), UserError);
  EXPECT_EQ(feed.events(kNsPerMs).size(), 40U * 3 * 4);
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { feed.frame(Image<float>(40, 3, 0.9F), 3 * kNsPerMs); }),
                             "cannot go on"));
}

TEST(EventCamera, TimesFarFromZeroAreAsExactAsAnyOthers) {
  // Nanoseconds since 1970, and the short packing range of a large image.
  for (const TimeNs start : {TimeNs{1'700'000'000} * kNsPerSecond, -TimeNs{5'000'000'000} * kNsPerSecond}) {
    const EventCameraOptions options{.contrast_threshold = 0.3, .leak_rate_hz = 3, .shot_noise_hz = 20};
    Feed here(options, 20, 10, 1), there(options, 20, 10, 1);
    TimeNs t = 0;
    for (const Image<float>& frame : random_frames(20, 10, 30, 2)) {
      here.frame(frame, t), there.frame(frame, start + t);
      t += 10 * kNsPerMs;
    }
    std::vector<Event> expected = here.events();
    for (Event& event : expected) event.t += start;
    EXPECT_EQ(there.events(), expected);
    EXPECT_GT(expected.size(), 500U);
  }
}

}  // namespace
}  // namespace esim
