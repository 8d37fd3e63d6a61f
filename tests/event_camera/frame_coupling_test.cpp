// What the exposure of frames does to the pixels of the same chip.
#include "esim/event_camera/circuit/frame_coupling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "esim/core/error.h"
#include "esim/event_camera/event_camera.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr double kCoupling = 0.03, kRate_hz = 22.7, kExposure_ms = 6;

CircuitOptions framed() {
  CircuitOptions options;
  options.frame_coupling = kCoupling, options.frame_rate_hz = kRate_hz, options.frame_exposure_ms = kExposure_ms;
  return options;
}

constexpr double kOneNs = kCoupling / 10e-6 * 1e-9;  // the steepest change within it

/// By its definition, t and the offset in s.
double defined(double t, double offset) {
  const double half = 0.5e-3 * kExposure_ms;
  for (int frame = -30; frame < 20; ++frame) {
    const double begin = offset + frame / kRate_hz - half, end = offset + frame / kRate_hz + half;
    if (begin <= 0) continue;
    if (t >= begin && t < end) return -kCoupling * std::min(1.0, (t - begin) / 200e-6);
    if (t >= end && t < end + 10e-6) return -kCoupling * (1 - (t - end) / 10e-6);
  }
  return 0;
}

TEST(FrameCoupling, IsLinearBetweenItsCorners) {
  EXPECT_FALSE(FrameCoupling({.frame_rate_hz = kRate_hz, .frame_exposure_ms = kExposure_ms}).active());
  std::mt19937_64 random(1);
  for (const double offset_ms : {0.0, 2.0, 10.0, 46.0, 1000.0}) {
    CircuitOptions options = framed();
    options.frame_offset_ms = offset_ms;
    const FrameCoupling coupling(options);
    ASSERT_TRUE(coupling.active());
    int corners = 0;
    for (TimeNs t = 0; t < 500 * kNsPerMs; ++corners) {
      const TimeNs corner = coupling.next_corner(t);
      ASSERT_GT(corner, t);
      const Ramp ramp = coupling.at(static_cast<double>(t));
      for (int i = 0; i < 20; ++i) {
        const double s = static_cast<double>(random() % static_cast<std::uint64_t>(corner - t));
        const double there = static_cast<double>(t) + s;
        EXPECT_NEAR(ramp.value + ramp.slope * s, defined(1e-9 * there, 1e-3 * offset_ms), kOneNs) << there;
        EXPECT_NEAR(coupling.at(there).value, defined(1e-9 * there, 1e-3 * offset_ms), kOneNs) << there;
      }
      EXPECT_NEAR(ramp.value + ramp.slope * static_cast<double>(corner - t),
                  coupling.at(static_cast<double>(corner)).value, 1e-12)
          << "no jump at " << corner;
      t = corner;
    }
    if (offset_ms == 0) {
      EXPECT_EQ(corners, 4 * 11 + 1);  // 11 frames, and the beginning of the next one
    }
  }
}

TEST(CornerDivider, DividesAtCornersWithTheIrradianceThere) {
  const FrameCoupling coupling(framed());
  const Tile tile{2, 1, 3, 2};
  Image<float> before(8, 5, 0.25F), after(8, 5, 1.25F);
  before(3, 2) = 0.5F;
  const TimeNs epoch = -7, t0 = 30 * kNsPerMs, t1 = 60 * kNsPerMs;
  const std::vector<Segment> given{{tile, t0, t0, &before, &before}, {tile, t0, t1, &before, &after}};
  CornerDivider divider;
  const auto divided = divider.divide(given, coupling, epoch);
  ASSERT_EQ(divided.size(), 6U);
  EXPECT_EQ(divided[0].t1, t0);
  TimeNs t = t0;
  for (const Segment& segment : divided.subspan(1)) {
    EXPECT_EQ(segment.tile, tile);
    EXPECT_EQ(segment.t0, t);
    const double part = static_cast<double>(segment.t1 - t0) / static_cast<double>(t1 - t0);
    EXPECT_NEAR(segment.irradiance1(3, 2), 0.5 + part * 0.75, 1e-6);
    EXPECT_NEAR(segment.irradiance1(4, 1), 0.25 + part, 1e-6);
    t = segment.t1;
    if (t < t1) {
      EXPECT_EQ(t, epoch + coupling.next_corner(t - epoch - 1));
    }
  }
  EXPECT_EQ(t, t1);
}

/// Without noise, in constant light, the states of pixels are uniform between the thresholds. The first exposure fires
/// those within the coupling of the OFF threshold; nothing else happens.
TEST(FrameCoupling, ThePixelsNearTheirThresholdsFire) {
  EventCameraOptions options;
  options.contrast_threshold = 0.2;
  options.circuit = framed();
  options.circuit->noise = 0;
  constexpr int kWidth = 200, kHeight = 150;
  EventCamera camera(options, kWidth, kHeight, 5);
  const Workers workers(1);
  const Image<float> grey(kWidth, kHeight, 0.3F);
  std::vector<Event> events;
  camera.process(grey, 0, events, workers);
  camera.process(grey, 200 * kNsPerMs, events, workers);
  const double expected = kWidth * kHeight * kCoupling / 0.4;
  EXPECT_NEAR(static_cast<double>(events.size()), expected, 4 * std::sqrt(expected));
  const TimeNs begin = to_ns(1 / kRate_hz - 0.5e-3 * kExposure_ms);
  for (const Event& event : events) {
    EXPECT_EQ(event.polarity, -1);
    EXPECT_GE(event.t, begin);
    EXPECT_LE(event.t, begin + 200 * kNsPerUs + 1);
  }
  // Within the fall, all times are equally probable.
  const auto early =
      std::count_if(events.begin(), events.end(), [&](const Event& event) { return event.t < begin + 100 * kNsPerUs; });
  EXPECT_NEAR(static_cast<double>(early), 0.5 * expected, 4 * std::sqrt(0.5 * expected));
}

/// In rising light, exposures delay ON events: none for a while, then many at once, and as many in the end.
TEST(FrameCoupling, OnEventsWaitForTheEndOfTheExposure) {
  EventCameraOptions options;
  options.contrast_threshold = 0.2;
  options.circuit = framed();
  options.circuit->noise = 0;
  options.circuit->source_follower_hz = 3000;
  constexpr int kWidth = 200, kHeight = 150;
  const auto record = [&](double coupling) {
    options.circuit->frame_coupling = coupling;
    EventCamera camera(options, kWidth, kHeight, 5);
    const Workers workers(1);
    std::vector<Event> events;
    for (int k = 0; k <= 80; ++k) {
      const auto e = static_cast<float>(0.2 * std::exp(2e-3 * k));  // 2 per second: 10 ON events per second
      camera.process(Image<float>(kWidth, kHeight, e), k * kNsPerMs, events, workers);
    }
    return events;
  };
  const std::vector<Event> with = record(kCoupling), without = record(0);
  const auto on = [](const std::vector<Event>& events, double from_s, double to_s) {
    return static_cast<double>(std::count_if(events.begin(), events.end(), [&](const Event& event) {
      return event.polarity > 0 && event.t >= to_ns(from_s) && event.t < to_ns(to_s);
    }));
  };
  const double begin = 1 / kRate_hz - 0.5e-3 * kExposure_ms, end = begin + 1e-3 * kExposure_ms;
  EXPECT_EQ(on(with, begin + 250e-6, end), 0) << "the light rises by 0.012 during the exposure";
  const double expected = kWidth * kHeight * 1e-3 * kExposure_ms * 2 / 0.4;
  EXPECT_NEAR(on(with, end, end + 50e-6), expected, 4 * std::sqrt(expected));
  EXPECT_EQ(on(with, 0, 0.08), on(without, 0, 0.08));
}

TEST(FrameCoupling, WithoutAFrameCameraFramesAreThoseOfTheEventCameraDataset) {
  const FrameCoupling usual({.frame_coupling = kCoupling}), framed_by_hand(framed());
  for (TimeNs t = 0; t < 1000 * kNsPerMs; t += 100 * kNsPerUs)
    EXPECT_EQ(usual.at(static_cast<double>(t)).value, framed_by_hand.at(static_cast<double>(t)).value) << t;
}

TEST(FrameCoupling, ExposuresThatDoNotFitAreRefused) {
  EventCameraOptions options;
  options.circuit = framed();
  options.circuit->frame_exposure_ms = 50;
  const std::string message = test::message_of<UserError>([&] { EventCamera(options, 4, 4); });
  EXPECT_TRUE(test::contains(message, "circuit.frame_exposure_ms") && test::contains(message, "44.0")) << message;
}

}  // namespace
}  // namespace esim
