#include "esim/event_camera/center_surround.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "esim/core/error.h"
#include "event_camera/feed.h"
#include "support/errors.h"

namespace esim {
namespace {

constexpr int kWidth = 12, kHeight = 8;

Image<float> random_image(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  Image<float> image(kWidth, kHeight);
  for (float& value : image.pixels()) value = normal(random);
  return image;
}

/// One small step of tau dh/dt = (L - h) + reach^2 Laplacian(h), borders mirrored.
void diffuse(Image<double>& h, const Image<double>& brightness, double reach, double step_per_tau) {
  Image<double> next = h;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double laplacian = h(std::max(x - 1, 0), y) + h(std::min(x + 1, kWidth - 1), y) + h(x, std::max(y - 1, 0)) +
                               h(x, std::min(y + 1, kHeight - 1)) - 4 * h(x, y);
      next(x, y) += step_per_tau * (brightness(x, y) - h(x, y) + reach * reach * laplacian);
    }
  }
  h = next;
}

TEST(CenterSurround, AgreesWithSmallSteps) {
  constexpr double kReach = 1.5, kTau = 0.01;
  constexpr int kSteps = 4000;
  CenterSurround surround(kReach, kTau, kWidth, kHeight);
  Image<float> signal = random_image(1);
  Image<double> h(kWidth, kHeight), brightness(kWidth, kHeight);
  std::copy(signal.pixels().begin(), signal.pixels().end(), brightness.data());
  h = brightness;
  for (int i = 0; i < 40'000; ++i) diffuse(h, brightness, kReach, 1e-2);  // the steady state
  surround.open(signal);
  for (std::size_t i = 0; i < signal.size(); ++i)
    EXPECT_NEAR(signal.data()[i], brightness.data()[i] - h.data()[i], 1e-5);

  for (unsigned k = 2; k < 6; ++k) {
    const double duration = 0.004 * k;
    signal = random_image(k);
    const Image<double> before = brightness;
    Image<double> now = before;
    std::copy(signal.pixels().begin(), signal.pixels().end(), brightness.data());
    for (int i = 0; i < kSteps; ++i) {
      for (std::size_t j = 0; j < now.size(); ++j)
        now.data()[j] = before.data()[j] + (brightness.data()[j] - before.data()[j]) * (i + 0.5) / kSteps;
      diffuse(h, now, kReach, duration / kTau / kSteps);
    }
    surround.advance(signal, duration);
    for (std::size_t i = 0; i < signal.size(); ++i)
      EXPECT_NEAR(signal.data()[i], brightness.data()[i] - h.data()[i], 2e-3);
  }
}

TEST(CenterSurround, MakesACameraBlindToUniformLight) {
  EventCameraOptions options;
  options.contrast_threshold = 0.1;
  options.surround_px = 2;
  test::Feed feed(options, kWidth, kHeight);
  for (int k = 0; k < 10; ++k)
    feed.frame(Image<float>(kWidth, kHeight, 0.1F * static_cast<float>(1 + k)), k * kNsPerMs);
  EXPECT_TRUE(feed.events().empty());
  Image<float> spot(kWidth, kHeight, 1.0F);
  spot(5, 4) = 2.0F;
  feed.frame(spot, 20 * kNsPerMs);
  const std::vector<Event> events = feed.events();
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(std::max_element(events.begin(), events.end(), [](auto& a, auto& b) { return a.polarity < b.polarity; })->x,
            5);
}

TEST(CenterSurround, SaysWhatItNeeds) {
  EventCameraOptions options;
  options.surround_px = 2;
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { EventCamera(options, 11, 8); }), "even"));
  test::Feed feed(options, kWidth, kHeight);
  const std::string message = test::message_of<UserError>([&] {
    feed.feed(Image<float>(kWidth, kHeight, 1.0F), 0, {Tile{0, 0, 6, 8}, Tile{6, 0, 6, 8}});
  });
  EXPECT_TRUE(test::contains(message, "whole images")) << message;
}

}  // namespace
}  // namespace esim
