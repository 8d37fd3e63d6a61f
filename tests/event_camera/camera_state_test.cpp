#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "esim/core/error.h"
#include "event_camera/feed.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kWidth = 38, kHeight = 12;

class CameraState : public testing::TestWithParam<EventCameraOptions> {
 protected:
  /// A frame every millisecond, and the events of each.
  std::vector<Event> process(EventCamera& camera, int first, int count) {
    std::vector<Event> events;
    for (int k = first; k < first + count; ++k) {
      std::mt19937 random(static_cast<unsigned>(k));
      Image<float> frame(kWidth, kHeight);
      for (float& value : frame.pixels()) value = static_cast<float>(random() % 1000) * 1e-3F;
      camera.process(frame, k * kNsPerMs, events, test::kOneThread);
    }
    return events;
  }
  static std::vector<std::uint64_t> dropped_by_filters(const EventCamera& camera) {
    std::vector<std::uint64_t> dropped;
    for (const FilterChain::Dropped& filter : camera.statistics().filtered) dropped.push_back(filter.events);
    return dropped;
  }
  EventCamera made() const { return EventCamera(GetParam(), kWidth, kHeight, 5, 2); }
};

TEST_P(CameraState, ARestoredCameraGoesOnWhereTheOtherWas) {
  for (const int frames : {0, 1, 2, 9}) {
    EventCamera camera = made(), restored = made();
    process(camera, 0, frames);
    const std::vector<std::byte> state = camera.state();
    process(restored, 20, 3);  // independent of its earlier input
    restored.restore(state);
    EXPECT_EQ(restored.statistics().dropped, camera.statistics().dropped);
    EXPECT_EQ(restored.statistics().in_flight, camera.statistics().in_flight);
    const std::vector<Event> expected = process(camera, frames, 6);
    EXPECT_GT(expected.size(), 500U);
    EXPECT_EQ(process(restored, frames, 6), expected);
    EXPECT_EQ(dropped_by_filters(restored), dropped_by_filters(camera));
    EXPECT_EQ(restored.statistics().read_out, camera.statistics().read_out);
    EXPECT_EQ(restored.statistics().dropped, camera.statistics().dropped);
    EXPECT_EQ(restored.statistics().in_flight, camera.statistics().in_flight);
  }
}

TEST_P(CameraState, TakingItChangesNothing) {
  EventCamera camera = made(), undisturbed = made();
  for (int k = 0; k < 8; ++k) {
    EXPECT_EQ(process(camera, k, 1), process(undisturbed, k, 1));
    EXPECT_EQ(camera.state().size(), undisturbed.state().size());
  }
}

TEST_P(CameraState, OtherLengthsAreRefused) {
  EventCamera camera = made();
  process(camera, 0, 3);
  std::vector<std::byte> state = camera.state();
  state.push_back({});
  EXPECT_THROW(made().restore(state), UserError);
  for (const std::size_t length : {state.size() - 2, state.size() / 2, std::size_t{1}, std::size_t{0}})
    EXPECT_THROW(made().restore(std::span(state).first(length)), UserError) << length;
  EventCamera smaller(GetParam(), kWidth - 2, kHeight, 5, 2);
  state.pop_back();
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { smaller.restore(state); }), "other arguments"));
}

INSTANTIATE_TEST_SUITE_P(
    Options, CameraState,
    testing::Values(
        EventCameraOptions{.contrast_threshold = 0.2},
        EventCameraOptions{.contrast_threshold = 0.2, .threshold_mismatch = 0.03, .refractory_period_us = 700},
        EventCameraOptions{.contrast_threshold = 0.2, .low_pass_hz = 300, .low_pass_order = 2},
        EventCameraOptions{.contrast_threshold = 0.2, .response = PixelResponse::lin_log},
        EventCameraOptions{.contrast_threshold = 0.2, .surround_px = 2, .surround_ms = 3},
        // Latencies of several frames, so that events are still in the queue.
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
                           .latency_us = 2500,
                           .latency_jitter_us = 900,
                           .latency_light_share = 0.7},
        EventCameraOptions{.contrast_threshold = 0.2,
                           .latency_us = 2500,
                           .filters = {.region = RegionFilterOptions{true, {{3, 3, 4, 4}}, {{20, 5}}},
                                       .activity = ActivityFilterOptions{2000, 1e5, 5e4, 0, 0},
                                       .anti_flicker = AntiFlickerOptions{FlickerMode::band_stop, 200, 5000, 2, 1},
                                       .trail = TrailFilterOptions{TrailType::trail, 500},
                                       .rate_controller = RateControllerOptions{2000, 900}}},
        // A queue that overflows, with waiting rows of several events each.
        EventCameraOptions{.contrast_threshold = 0.2,
                           .readout = {.rate_mev_per_s = 0.7, .row_time_us = 5, .queue_events = 500}}));

}  // namespace
}  // namespace esim
