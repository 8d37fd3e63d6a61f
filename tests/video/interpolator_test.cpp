#include "esim/video/interpolator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "esim/core/error.h"
#include "support/errors.h"
#include "video/videos.h"

namespace esim {
namespace {

using test::Scene;
using test::view;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kEps = 0.001;

const test::Pattern kPattern(1), kOther(2);

Scene translation(double dx, double dy) {
  return [=](double x, double y, double t) { return kPattern(x - dx * t, y - dy * t); };
}

Scene rotation(double degrees) {
  return [=](double x, double y, double t) {
    const double angle = degrees * std::numbers::pi / 180 * t, u = x - kWidth / 2, v = y - kHeight / 2;
    return kPattern(std::cos(angle) * u + std::sin(angle) * v, std::cos(angle) * v - std::sin(angle) * u);
  };
}

/// A disc in front of a background that moves in the opposite direction: content appears and disappears at its rim.
double occlusion(double x, double y, double t) {
  const double u = x - 60 - 6 * t, v = y - 60, inside = std::clamp(30.5 - std::hypot(u, v), 0.0, 1.0);
  return inside * kOther(u, v) + (1 - inside) * kPattern(x + 2 * t, y);
}

Frame frame_of(Image<float> image, TimeNs t = 0) { return {t, {std::move(image)}}; }

double brightness(float light) { return std::log(static_cast<double>(light) + kEps); }

struct Errors {
  double interpolated = 0, blended = 0;  // root mean squares of brightness
};

Errors errors(const Scene& scene, double fraction) {
  const Workers workers(1);
  const Image<float> frame0 = view(scene, kWidth, kHeight, 0), frame1 = view(scene, kWidth, kHeight, 1);
  Interpolator interpolator({}, kEps);
  interpolator.advance(frame_of(frame0), workers);
  interpolator.advance(frame_of(frame1), workers);
  Planes light;
  interpolator.at(fraction, workers, light);
  const Image<float> truth = view(scene, kWidth, kHeight, fraction);
  Errors sums;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double expected = brightness(truth.pixels()[i]);
    const double before = brightness(frame0.pixels()[i]), after = brightness(frame1.pixels()[i]);
    sums.interpolated += std::pow(brightness(light[0].pixels()[i]) - expected, 2);
    sums.blended += std::pow(before + fraction * (after - before) - expected, 2);
  }
  return {std::sqrt(sums.interpolated / double(truth.size())), std::sqrt(sums.blended / double(truth.size()))};
}

TEST(Interpolator, FindsTheFramesBetween) {
  for (const Scene& scene : {translation(3, 1), translation(-2, 3), rotation(3)}) {
    for (const double fraction : {0.1, 0.5, 0.75}) {
      const Errors e = errors(scene, fraction);
      EXPECT_LT(e.interpolated, 0.05);
      EXPECT_LT(e.interpolated, 0.2 * e.blended);
    }
  }
}

TEST(Interpolator, IsNotWorseThanBlendingWhereThingsAppear) {
  const Errors e = errors(occlusion, 0.5);
  EXPECT_LT(e.interpolated, 0.4 * e.blended);
}

TEST(Interpolator, TendsToTheFramesAtBothEnds) {
  const Workers workers(1);
  const Image<float> frame0 = view(occlusion, kWidth, kHeight, 0), frame1 = view(occlusion, kWidth, kHeight, 1);
  Interpolator interpolator({}, kEps);
  interpolator.advance(frame_of(frame0), workers);
  interpolator.advance(frame_of(frame1), workers);
  Planes light;
  for (const double fraction : {0.0, 1.0, 1e-4, 1 - 1e-4}) {
    interpolator.at(fraction, workers, light);
    const Image<float>& end = fraction < 0.5 ? frame0 : frame1;
    const double room = fraction == std::round(fraction) ? 1e-5 : 2e-3;
    for (std::size_t i = 0; i < end.size(); ++i) {
      ASSERT_NEAR(brightness(light[0].pixels()[i]), brightness(end.pixels()[i]), room) << i;
    }
  }
}

TEST(Interpolator, NoPixelMovesFartherThanLambdaInAStep) {
  const Workers workers(1);
  for (const double lambda : {0.25, 0.5, 2.0}) {
    Interpolator interpolator({.lambda = lambda}, kEps);
    for (const double t : {0, 1}) interpolator.advance(frame_of(view(translation(3, 1), kWidth, kHeight, t)), workers);
    EXPECT_GE(interpolator.steps() * lambda, interpolator.max_flow_px());
    EXPECT_GE(interpolator.max_flow_px(), 0.98 * std::hypot(3, 1));
    EXPECT_LT(interpolator.max_flow_px(), 1.4 * std::hypot(3, 1)) << "wastes steps";
    EXPECT_FALSE(interpolator.is_held());
  }
  Interpolator held({.max_steps = 3}, kEps);
  for (const double t : {0, 1}) held.advance(frame_of(view(translation(3, 1), kWidth, kHeight, t)), workers);
  EXPECT_EQ(held.steps(), 3);
  EXPECT_TRUE(held.is_held());
}

TEST(Interpolator, AStillSceneNeedsNoSteps) {
  const Workers workers(1);
  const Image<float> frame = view(translation(0, 0), kWidth, kHeight);
  Interpolator interpolator({}, kEps);
  for (int i = 0; i < 3; ++i) interpolator.advance(frame_of(frame), workers);
  EXPECT_EQ(interpolator.steps(), 1);
  EXPECT_EQ(interpolator.max_flow_px(), 0);
}

TEST(Interpolator, BrightnessThatChangesInPlaceIsBlended) {
  EXPECT_LT(errors([](double x, double y, double t) { return kPattern(x, y) * std::exp(0.7 * t); }, 0.5).interpolated,
            0.01);
}

TEST(Interpolator, AnyContentStaysWithinWhatTheFramesHold) {
  // Unrelated frames, extreme irradiance, and sizes down to one pixel.
  const Workers workers(2);
  std::mt19937 random(3);
  for (const auto& [width, height] : {std::pair{90, 70}, {1, 1}, {5, 40}, {40, 5}, {17, 16}}) {
    Interpolator interpolator({}, kEps);
    for (int i = 0; i < 3; ++i) {
      Image<float> frame(width, height);
      for (float& light : frame.pixels())
        light = random() % 3 == 0 ? 0.0F : static_cast<float>(random() % 1000) * 10.0F;
      interpolator.advance(frame_of(frame), workers);
    }
    EXPECT_LE(interpolator.steps(), 200);
    Planes light;
    for (const double fraction : {0.01, 0.5, 0.9}) {
      interpolator.at(fraction, workers, light);
      for (const float value : light[0].pixels()) {
        ASSERT_GE(value, 0.0F);
        ASSERT_LT(brightness(value), brightness(1e4F) + 0.6 * (brightness(1e4F) - brightness(0))) << "overshoot";
      }
    }
  }
}

double followed_fraction(const Scene& scene) {
  const Workers workers(1);
  Interpolator interpolator({}, kEps);
  for (const double t : {0, 1}) interpolator.advance(frame_of(view(scene, kWidth, kHeight, t)), workers);
  const FollowedPixels pixels = interpolator.followed_pixels();
  EXPECT_GT(pixels.changed, kWidth * kHeight / 10);
  return static_cast<double>(pixels.followed) / static_cast<double>(pixels.changed);
}

TEST(Interpolator, CountsThePixelsThatTheFlowFollows) {
  EXPECT_GT(followed_fraction(translation(3, 1)), 0.95);
  EXPECT_GT(followed_fraction(translation(8, -3)), 0.9);
  EXPECT_GT(followed_fraction(rotation(3)), 0.95);
  // Motion across most of the image, a change without motion, and frames that have nothing in common.
  EXPECT_LT(followed_fraction(translation(120, 0)), 0.5);
  EXPECT_LT(followed_fraction([](double x, double y, double t) { return kPattern(x, y) * std::exp(0.7 * t); }), 0.1);
  EXPECT_LT(followed_fraction([](double x, double y, double t) { return t == 0 ? kPattern(x, y) : kOther(x, y); }),
            0.5);
}

TEST(Interpolator, NothingChangesInAStillScene) {
  const Workers workers(1);
  Interpolator interpolator({}, kEps);
  for (int i = 0; i < 2; ++i) interpolator.advance(frame_of(view(occlusion, kWidth, kHeight)), workers);
  EXPECT_EQ(interpolator.followed_pixels().changed, 0);
}

/// Returns what it is told to, and keeps what it was asked.
struct Told final : FrameInterpolator {
  std::string name() const override { return "the test's interpolator"; }
  void between(const Frame& frame0, const Frame& frame1, double fraction, Planes& light) override {
    EXPECT_EQ(frame0.t, 1'000'000'000);
    EXPECT_EQ(frame1.t, 1'040'000'000);
    asked = fraction;
    light = {answer};
  }

  Image<float> answer;
  double asked = -1;
};

TEST(Interpolator, AnInterpolatorOfTheUserMakesTheImages) {
  const Workers workers(1);
  auto images = std::make_unique<Told>();
  Told& told = *images;
  Interpolator interpolator({}, kEps, std::move(images));
  interpolator.advance(frame_of(view(translation(3, 1), kWidth, kHeight, 0), 1'000'000'000), workers);
  interpolator.advance(frame_of(view(translation(3, 1), kWidth, kHeight, 1), 1'040'000'000), workers);
  EXPECT_GE(interpolator.steps(), 6) << "the number of steps follows from the optical flow";

  told.answer = Image<float>(kWidth, kHeight, 0.4F);
  Planes light;
  interpolator.at(0.25, workers, light);
  EXPECT_EQ(told.asked, 0.25);
  EXPECT_EQ(light[0](5, 6), 0.4F);

  const auto problem = [&] { return test::message_of<UserError>([&] { interpolator.at(0.25, workers, light); }); };
  told.answer(7, 9) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(problem(),
            "the test's interpolator, for the image at 1.010000000 s between the frames at 1.000000000 s and "
            "1.040000000 s: pixel (7, 9) is nan; irradiance must be finite and >= 0");
  told.answer = Image<float>(kWidth, kHeight - 1, 0.4F);
  EXPECT_TRUE(test::contains(problem(), "must have the size and the number of planes of the frames"));
}

TEST(Interpolator, TheSameBitsOnAnyNumberOfThreads) {
  std::vector<std::vector<float>> results;
  for (const int threads : {1, 2, 5}) {
    const Workers workers(threads);
    Interpolator interpolator({}, kEps);
    for (const double t : {0, 1}) {
      const Image<float> grey = view(occlusion, kWidth, kHeight, t);
      interpolator.advance({0, {grey, view(rotation(2), kWidth, kHeight, t), grey}}, workers);
    }
    Planes light;
    interpolator.at(0.37, workers, light);
    results.emplace_back(light[1].pixels().begin(), light[1].pixels().end());
    results.back().push_back(static_cast<float>(interpolator.max_flow_px()));
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

}  // namespace
}  // namespace esim
