#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "esim/event_camera/reference.h"
#include "event_camera/feed.h"

// The effect of the readout on the pixels.
namespace esim {
namespace {

constexpr int kWidth = 24, kHeight = 10;

/// Frames of a scene that flickers randomly, with many events in some frames and few in others.
std::vector<Image<float>> frames_of(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<Image<float>> frames(1, Image<float>(kWidth, kHeight, 0.3F));
  while (static_cast<int>(frames.size()) < count) {
    Image<float> next = frames.back();
    const float size = frames.size() % 5 == 0 ? 1.5F : 0.2F;
    for (float& value : next.pixels()) value = std::clamp(value * std::exp(size * normal(random)), 0.001F, 20.0F);
    frames.push_back(next);
  }
  return frames;
}

struct Setting {
  const char* name;
  EventCameraOptions options;
};

EventCameraOptions with(EventCameraOptions options, ReadoutOptions readout) {
  options.readout = readout;
  return options;
}

const EventCameraOptions kClean{.contrast_threshold = 0.1, .threshold_mismatch = 0.02, .refractory_period_us = 100};
const EventCameraOptions kNoisy{.contrast_threshold = 0.15,
                                .threshold_mismatch = 0.02,
                                .threshold_noise = 0.03,
                                .refractory_period_us = 60,
                                .leak_rate_hz = 20,
                                .leak_mismatch_decades = 0.2,
                                .leak_jitter = 0.1,
                                .shot_noise_hz = 200,
                                .hot_pixels = 0.01,
                                .dead_pixels = 0.02,
                                .latency_us = 15,
                                .latency_jitter_us = 4,
                                .latency_light_share = 0.3};
constexpr ReadoutOptions kSaturated{.rate_mev_per_s = 0.5}, kBusy{.rate_mev_per_s = 4, .row_time_us = 0.3},
    kQuick{.rate_mev_per_s = 100};

class PixelReadoutTest : public testing::TestWithParam<Setting> {};

std::string name_of(const testing::TestParamInfo<Setting>& info) { return info.param.name; }

std::vector<Event> feed_whole(const EventCameraOptions& options, const std::vector<Image<float>>& frames,
                              const Workers& workers = test::kOneThread) {
  test::Feed feed(options, kWidth, kHeight, 7);
  std::vector<Event> events;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const TimeNs t = static_cast<TimeNs>(k) * kNsPerMs;
    feed.frame(frames[k], t, workers);
    for (const Event& event : feed.events(t)) events.push_back(event);
  }
  return events;
}

using Pixel = std::pair<int, int>;

std::map<Pixel, std::vector<Event>> by_pixel(const std::vector<Event>& events) {
  std::map<Pixel, std::vector<Event>> pixels;
  for (const Event& event : events) pixels[{event.x, event.y}].push_back(event);
  return pixels;
}

INSTANTIATE_TEST_SUITE_P(
    Sensors, PixelReadoutTest,
    testing::Values(
        Setting{"clean_saturated", with(kClean, kSaturated)}, Setting{"clean_busy", with(kClean, kBusy)},
        Setting{"clean_quick", with(kClean, kQuick)}, Setting{"noisy_saturated", with(kNoisy, kSaturated)},
        Setting{"noisy_busy", with(kNoisy, kBusy)}, Setting{"noisy_quick", with(kNoisy, kQuick)},
        Setting{"no_refractory_period", with({.contrast_threshold = 0.1, .threshold_mismatch = 0.02}, kSaturated)},
        Setting{"no_refractory_period_busy", with({.contrast_threshold = 0.1, .threshold_mismatch = 0.02}, kBusy)},
        Setting{"drop", with({.contrast_threshold = 0.1,
                              .threshold_mismatch = 0.02,
                              .refractory_period_us = 50,
                              .refractory_mode = RefractoryMode::drop},
                             kSaturated)},
        Setting{"drop_noisy", with({.contrast_threshold = 0.1,
                                    .threshold_noise = 0.03,
                                    .refractory_period_us = 50,
                                    .refractory_mode = RefractoryMode::drop,
                                    .latency_us = 10},
                                   kBusy)}),
    name_of);

TEST_P(PixelReadoutTest, IsThatOfTheReference) {
  const std::vector<Image<float>> frames = frames_of(40, 3);
  ReferenceEventCamera reference(GetParam().options, kWidth, kHeight, 7, 0);
  std::vector<Event> expected;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    for (const Event& event : reference.process(frames[k], static_cast<TimeNs>(k) * kNsPerMs))
      expected.push_back(event);
  }
  const std::vector<Event> events = feed_whole(GetParam().options, frames);
  EXPECT_TRUE(std::ranges::is_sorted(events));
  EXPECT_GT(events.size(), 1000U);
  ASSERT_EQ(events.size(), expected.size());
  const auto pixels = by_pixel(events), expected_pixels = by_pixel(expected);
  for (const auto& [pixel, own] : pixels) {
    const std::vector<Event>& others = expected_pixels.at(pixel);
    ASSERT_EQ(own.size(), others.size()) << pixel.first << ", " << pixel.second;
    for (std::size_t i = 0; i < own.size(); ++i) {
      ASSERT_EQ(own[i].polarity, others[i].polarity) << "at " << own[i].t;
      ASSERT_NEAR(static_cast<double>(own[i].t), static_cast<double>(others[i].t), 3);
    }
  }
}

TEST_P(PixelReadoutTest, DoesNotDependOnThreads) {
  const std::vector<Image<float>> frames = frames_of(30, 4);
  EXPECT_EQ(feed_whole(GetParam().options, frames), feed_whole(GetParam().options, frames, Workers(2)));
}

/// Tiles of different sizes, each sampled at its own times and passed on out of order.
std::vector<Event> feed_tiles(const EventCameraOptions& options, const std::vector<Image<float>>& frames) {
  EventCamera camera(options, kWidth, kHeight, 7);
  const std::vector<Tile> tiles = {{0, 0, 7, 10}, {7, 0, 17, 4}, {7, 4, 17, 6}};
  std::vector<std::size_t> known(tiles.size(), 0);
  std::vector<Segment> segments;
  const auto at = [](std::size_t k) { return static_cast<TimeNs>(k) * kNsPerMs; };
  for (const Tile& tile : tiles) segments.push_back({tile, 0, 0, &frames[0], &frames[0]});
  camera.integrate(segments, 0, Workers(2));
  std::vector<Event> events;
  std::mt19937 random(1);
  while (*std::ranges::min_element(known) + 1 < frames.size()) {
    segments.clear();
    std::vector<Image<float>> copies;  // destroyed when the camera returns
    copies.reserve(100);
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      for (std::size_t more = random() % 4; more > 0 && known[i] + 1 < frames.size(); --more, ++known[i]) {
        const Image<float>& before = copies.emplace_back(frames[known[i]]);
        const Image<float>& after = copies.emplace_back(frames[known[i] + 1]);
        segments.push_back({tiles[i], at(known[i]), at(known[i] + 1), &before, &after});
      }
    }
    if (segments.empty()) continue;
    const TimeNs watermark = at(*std::ranges::min_element(known));
    camera.integrate(segments, watermark, Workers(2));
    std::ranges::copy(camera.release_until(watermark), std::back_inserter(events));
  }
  return events;
}

TEST_P(PixelReadoutTest, DoesNotDependOnTilesAndWatermarks) {
  const std::vector<Image<float>> frames = frames_of(30, 5);
  for (const double low_pass_hz : {0.0, 400.0}) {
    for (const int order : {1, 2}) {
      EventCameraOptions options = GetParam().options;
      options.low_pass_hz = low_pass_hz, options.low_pass_order = order;
      const std::vector<Event> whole = feed_whole(options, frames);
      EXPECT_GT(whole.size(), 100U);
      const std::vector<Event> tiles = feed_tiles(options, frames);
      const auto [first, other] = std::ranges::mismatch(whole, tiles);
      EXPECT_TRUE(first == whole.end() && other == tiles.end())
          << low_pass_hz << " Hz, " << order << " poles: " << whole.size() << " and " << tiles.size()
          << " events, from " << first - whole.begin() << " on";
    }
  }
}

TEST_P(PixelReadoutTest, HoldsOneRequestPerPixelAndThenTheRefractoryPeriod) {
  const EventCameraOptions& options = GetParam().options;
  const std::vector<Event> events = feed_whole(options, frames_of(40, 6));
  for (const auto& [pixel, own] : by_pixel(events)) {
    for (std::size_t i = 1; i < own.size(); ++i) {
      ASSERT_GT(own[i].t, own[i - 1].t) << pixel.first << ", " << pixel.second;
      // A request that waits for less than 1 % of the refractory period counts as read out immediately.
      ASSERT_GE(static_cast<double>(own[i].t - own[i - 1].t), 0.99 * options.refractory_period_us * 1e3);
    }
  }
}

TEST_P(PixelReadoutTest, AccountsForEveryRequest) {
  test::Feed feed(GetParam().options, kWidth, kHeight, 7);
  const std::vector<Image<float>> frames = frames_of(40, 6);
  for (std::size_t k = 0; k < frames.size(); ++k) feed.frame(frames[k], static_cast<TimeNs>(k) * kNsPerMs);
  const EventCameraStatistics before = feed.camera().statistics();
  EXPECT_EQ(before.dropped, 0);  // each pixel holds its request
  const auto released = static_cast<std::int64_t>(feed.events(40 * kNsPerMs).size());
  EXPECT_LE(feed.camera().statistics().in_flight, kWidth * kHeight);
  EXPECT_EQ(before.in_flight, released + feed.camera().statistics().in_flight);
}

/// If no request waits, the readout does not change the events.
TEST(PixelReadout, ChangesNothingWhereNothingWaits) {
  std::vector<Image<float>> frames(1, Image<float>(kWidth, kHeight, 0.1F));
  for (int k = 1; k < 40; ++k) {  // one pixel after another
    frames.push_back(frames.back());
    frames.back()(k % kWidth, k / kWidth) = 0.5F;
  }
  EventCameraOptions options{.contrast_threshold = 0.2, .refractory_period_us = 20};
  const std::vector<Event> free = feed_whole(options, frames);
  options.readout = {.rate_mev_per_s = 1};
  EXPECT_EQ(feed_whole(options, frames), free);
  EXPECT_GT(free.size(), 100U);
}

/// All pixels of a column brighten together, and the reader needs 100 us per row: the k-th row is read k rows later,
/// and sees its brightness only from then on.
TEST(PixelReadout, PixelsSeeTheirBrightnessFromTheirAcknowledgementOn) {
  constexpr int kRows = 10;
  constexpr double kRise = 2.0, kThreshold = 0.5;  // in 4 ms; ln
  EventCameraOptions options{.contrast_threshold = kThreshold, .log_eps = 0, .refractory_period_us = 50};
  options.readout = {.row_time_us = 100};
  test::Feed feed(options, 1, kRows, 0);
  feed.frame(Image<float>(1, kRows, 1.0F), 0);
  feed.frame(Image<float>(1, kRows, static_cast<float>(std::exp(kRise))), 4 * kNsPerMs);
  const auto pixels = by_pixel(feed.events(4 * kNsPerMs));
  ASSERT_EQ(pixels.size(), static_cast<std::size_t>(kRows));
  for (const auto& [pixel, events] : pixels) {
    // The first request of every pixel is after 1 ms. Later requests are 1 ms after the refractory period.
    const double first = 1000 + 100 * pixel.second;
    ASSERT_GE(events.size(), 2U);
    EXPECT_NEAR(static_cast<double>(events[0].t), first * 1e3, 2);
    const double until = pixel.second == 0 ? 1050 : first + 50;  // us
    EXPECT_NEAR(static_cast<double>(events[1].t), (until + 1000) * 1e3, 5);
  }
}

TEST(PixelReadout, DropsAndCountsRequestsBeyondItsQueue) {
  EventCameraOptions options = with(kClean, kSaturated);
  options.readout.queue_events = 20;
  test::Feed feed(options, kWidth, kHeight, 7);
  const std::vector<Image<float>> frames = frames_of(40, 6);
  for (std::size_t k = 0; k < frames.size(); ++k) feed.frame(frames[k], static_cast<TimeNs>(k) * kNsPerMs);
  EXPECT_GT(feed.camera().statistics().dropped, 100);
  EXPECT_GT(feed.camera().statistics().longest_delay, 20 * kNsPerUs);
  // At most 20 requests before it, and 20 in rows that have grown meanwhile, at 2 us each.
  EXPECT_LT(feed.camera().statistics().longest_delay, 2 * 2 * 21 * kNsPerUs + kNsPerUs);
}

/// A readout at its limit reports fewer and later events, and never two events of a pixel at the same time.
TEST(PixelReadout, ASaturatedSensorReportsEachPixelInTurn) {
  const EventCameraOptions options{.contrast_threshold = 0.05, .refractory_period_us = 10};
  const std::vector<Image<float>> frames = frames_of(60, 8);
  const std::vector<Event> free = feed_whole(options, frames);
  const std::vector<Event> read = feed_whole(with(options, {.rate_mev_per_s = 0.1}), frames);
  EXPECT_NEAR(static_cast<double>(read.size()), 0.1 * 59'000, 0.02 * 59'000);
  EXPECT_GT(free.size(), 5 * read.size());
  std::set<std::tuple<TimeNs, int, int>> seen;
  for (const Event& event : read) EXPECT_TRUE(seen.insert({event.t / kNsPerUs, event.x, event.y}).second);
}

/// Like all other effects, saturation is defined in continuous time.
TEST(PixelReadout, DoesNotDependOnSampling) {
  EventCameraOptions options = with(kNoisy, {.rate_mev_per_s = 1});
  options.low_pass_hz = 500;
  std::vector<double> counts;
  for (const int samples : {40, 200, 800}) {  // of 40 ms
    test::Feed feed(options, kWidth, kHeight, 7);
    std::size_t count = 0;
    for (int k = 0; k <= samples; ++k) {
      const double t = 0.04 * k / samples;
      Image<float> frame(kWidth, kHeight);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x)
          frame(x, y) = static_cast<float>(std::exp(std::sin(2 * M_PI * 50 * t + 0.3 * x + 0.7 * y)));
      }
      feed.frame(frame, to_ns(t));
      count += feed.events(to_ns(t)).size();
    }
    counts.push_back(static_cast<double>(count));
  }
  EXPECT_NEAR(counts[0], counts[2], 0.01 * counts[2]);  // linear segments of 1 ms only approximate the wave
  EXPECT_NEAR(counts[1], counts[2], 0.005 * counts[2]);
}

}  // namespace
}  // namespace esim
