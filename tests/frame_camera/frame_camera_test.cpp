#include "esim/frame_camera/frame_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "esim/core/error.h"
#include "esim/frame_camera/camera_response.h"
#include "esim/frame_camera/readout.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::message_of;
using Light = std::function<double(int x, int y, double t_s)>;

const Workers kOneThread(1);

/// 16 bits and no noise: digital numbers represent irradiance up to 1 within 8e-6.
FrameCameraOptions precise(double rate_hz, double exposure_s) {
  FrameCameraOptions options;
  options.rate_hz = rate_hz;
  options.exposure_s = exposure_s;
  options.bits = 16;
  return options;
}

double irradiance(std::uint16_t number) { return number / 65535.0; }

constexpr double kQuantum = 0.55 / 65535;  // half a digital number, and the rounding of floats

Image<float> sampled(const Light& light, int width, int height, TimeNs t) {
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<float>(light(x, y, to_seconds(t)));
  }
  return image;
}

/// Passes whole images at these times to a camera, and takes the frames.
std::vector<CameraFrame> show(FrameCamera& camera, const Light& light, int width, int height,
                              const std::vector<TimeNs>& times, const Workers& workers = kOneThread) {
  Image<float> before = sampled(light, width, height, times[0]);
  TimeNs last = times[0];
  std::vector<CameraFrame> frames;
  for (const TimeNs t : times) {
    const Image<float> now = sampled(light, width, height, t);
    const Segment segment{now.bounds(), last, t, &before, &now};
    camera.integrate({&segment, 1}, t, workers);
    while (camera.due() <= t) frames.push_back(camera.take());
    before = now, last = t;
  }
  return frames;
}

std::vector<TimeNs> every(TimeNs interval, TimeNs end) {
  std::vector<TimeNs> times;
  for (TimeNs t = 0; t < end; t += interval) times.push_back(t);
  times.push_back(end);
  return times;
}

TEST(FrameCamera, CentresFramesOnItsClockAndLeavesOutThoseThatDoNotFit) {
  FrameCamera camera(precise(100, 0.004), 3, 2, {kNsPerMs, 41 * kNsPerMs});
  const auto frames =
      show(camera, [](int, int, double) { return 0.5; }, 3, 2, {kNsPerMs, 20 * kNsPerMs, 41 * kNsPerMs});
  ASSERT_EQ(frames.size(), 3U);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(frames[k].t, (11 + 10 * static_cast<TimeNs>(k)) * kNsPerMs);
    EXPECT_EQ(frames[k].exposure_start, frames[k].t - 2 * kNsPerMs);
    EXPECT_EQ(frames[k].exposure_end, frames[k].t + 2 * kNsPerMs);
    EXPECT_EQ(frames[k].exposure, 4 * kNsPerMs);
  }
  EXPECT_EQ(camera.due(), FrameCamera::kNever);
  FrameCamera edge(precise(100, 0.01), 3, 2, {0, 15 * kNsPerMs});
  EXPECT_EQ(edge.due(), 15 * kNsPerMs) << "an exposure may begin with the first sample and end with the last";
  FrameCamera none(precise(100, 0.01), 3, 2, {0, 15 * kNsPerMs - 1});
  EXPECT_EQ(none.due(), FrameCamera::kNever);
}

TEST(FrameCamera, IntegratesARampExactlyHoweverItIsCut) {
  // E = a + b t: the mean over an exposure is E in its middle, for any sampling.
  const Light ramp = [](int x, int, double t) { return 0.1 + 0.05 * x + 6 * t; };
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    std::vector<TimeNs> times = {0, 100 * kNsPerMs};
    std::uniform_int_distribution<TimeNs> anywhere(1, 100 * kNsPerMs - 1);
    for (int i = 0; i < run * run; ++i) times.push_back(anywhere(random));
    std::sort(times.begin(), times.end());
    FrameCamera camera(precise(150, 0.0055), 5, 3, {0, 100 * kNsPerMs});
    const auto frames = show(camera, ramp, 5, 3, times);
    ASSERT_EQ(frames.size(), 14U);
    for (const CameraFrame& frame : frames) {
      for (int x = 0; x < 5; ++x)
        EXPECT_NEAR(irradiance(frame.numbers(x, 1)), ramp(x, 1, to_seconds(frame.t)), kQuantum) << run;
    }
  }
}

TEST(FrameCamera, IntegratesTheStraightLinesBetweenSamples) {
  // A triangle within the exposure [8, 12] ms: 0 until 9 ms, up to 0.8 at 10 ms, down to 0 at 11.5 ms.
  const Light triangle = [](int, int, double t) {
    const double ms = t * 1e3;
    return ms < 9 ? 0 : (ms < 10 ? 0.8 * (ms - 9) : std::max(0.0, 0.8 * (11.5 - ms) / 1.5));
  };
  FrameCamera camera(precise(100, 0.004), 1, 1, {0, 20 * kNsPerMs});
  const auto frames = show(camera, triangle, 1, 1, {0, 9 * kNsPerMs, 10 * kNsPerMs, 11'500'000, 20 * kNsPerMs});
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_NEAR(irradiance(frames[0].numbers(0, 0)), 0.5 * 0.8 * 2.5 / 4, kQuantum);

  // A step of 1 us at 9 ms, with sample times that differ from the exposure's limits.
  FrameCamera other(precise(100, 0.004), 1, 1, {0, 20 * kNsPerMs});
  const Light step = [](int, int, double t) { return t < 0.0090005 ? 0.1 : 0.9; };
  const auto seen = show(other, step, 1, 1, {0, 5 * kNsPerMs, 9 * kNsPerMs, 9'001'000, 14 * kNsPerMs, 20 * kNsPerMs});
  EXPECT_NEAR(irradiance(seen.at(0).numbers(0, 0)), 0.1 + 0.8 * (3 - 0.0005) / 4, kQuantum);
}

/// Irradiance that varies over pixels and time.
double waves(int x, int y, double t) { return 0.5 + 0.45 * std::sin(0.9 * x + 1.3 * y + 400 * t * (1 + 0.1 * x)); }

TEST(FrameCamera, SeesTheSameThroughTilesOfTheirOwnTimesInAnyOrder) {
  constexpr int kWidth = 37, kHeight = 26, kTile = 8;
  constexpr TimeNs kEnd = 200 * kNsPerMs;
  for (const bool automatic : {false, true}) {
    FrameCameraOptions options = precise(90, 0.006);
    options.line_delay_s = 1e-4;
    if (automatic) options.auto_exposure = AutoExposureOptions{.target = 0.35};
    // The knots of the irradiance: every sampling includes them, and possibly times in between.
    const auto knots = every(kNsPerMs, kEnd);
    const Light light = [&](int x, int y, double t) {
      const double knot = std::floor(t * 1e3 + 1e-9), share = t * 1e3 - knot;
      return (1 - share) * waves(x, y, knot * 1e-3) + share * waves(x, y, knot * 1e-3 + 1e-3);
    };
    FrameCamera whole(options, kWidth, kHeight, {0, kEnd});
    const auto expected = show(whole, light, kWidth, kHeight, knots);
    ASSERT_GT(expected.size(), 15U);

    std::mt19937 random(automatic ? 2 : 1);
    std::uniform_int_distribution<TimeNs> anywhere(1, kEnd - 1);
    struct Line {
      Tile tile;
      std::vector<TimeNs> times;
      std::size_t next = 0;
    };
    std::vector<Line> lines;
    for (int y = 0; y < kHeight; y += kTile) {
      for (int x = 0; x < kWidth; x += kTile) {
        Line line{{x, y, std::min(kTile, kWidth - x), std::min(kTile, kHeight - y)}, knots};
        for (int i = 0; i < 50; ++i) line.times.push_back(anywhere(random));
        std::sort(line.times.begin(), line.times.end());
        lines.push_back(line);
      }
    }
    // Tiles in random order, any of them ahead of the others; a few segments of a few tiles at a time.
    FrameCamera tiled(options, kWidth, kHeight, {0, kEnd});
    std::vector<CameraFrame> frames;
    const Workers two(2);
    while (true) {
      std::vector<Segment> segments;
      std::vector<Image<float>> images;
      images.reserve(1000);
      std::shuffle(lines.begin(), lines.end(), random);
      for (std::size_t i = 0; i < 3; ++i) {
        Line& line = lines[i];
        for (std::size_t count = random() % 30; count > 0 && line.next + 1 < line.times.size(); --count, ++line.next) {
          const TimeNs t0 = line.times[line.next], t1 = line.times[line.next + 1];
          const Image<float>& e0 = images.emplace_back(sampled(light, kWidth, kHeight, t0));
          const Image<float>& e1 = images.emplace_back(sampled(light, kWidth, kHeight, t1));
          segments.push_back({line.tile, t0, t1, &e0, &e1});
        }
      }
      TimeNs watermark = kEnd;
      for (const Line& line : lines) watermark = std::min(watermark, line.times[line.next]);
      tiled.integrate(segments, watermark, two);
      while (tiled.due() <= watermark) frames.push_back(tiled.take());
      if (watermark == kEnd) break;
    }
    ASSERT_EQ(frames.size(), expected.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      EXPECT_NEAR(static_cast<double>(frames[k].exposure), static_cast<double>(expected[k].exposure),
                  automatic ? 100 : 0);
      for (std::size_t i = 0; i < frames[k].numbers.size(); ++i)
        ASSERT_NEAR(frames[k].numbers.pixels()[i], expected[k].numbers.pixels()[i], automatic ? 3 : 1) << k;
    }
    if (automatic) {
      EXPECT_NE(frames[2].exposure, frames[0].exposure);
    }
  }
}

TEST(FrameCamera, TakesOneSegmentOfManyFrames) {
  FrameCameraOptions options = precise(1000, 0.0005);
  for (const bool automatic : {false, true}) {
    if (automatic) options.auto_exposure = AutoExposureOptions{.target = 0.2};
    FrameCamera camera(options, 2, 2, {0, kNsPerSecond});
    const auto frames =
        show(camera, [](int x, int, double t) { return 0.2 + 0.1 * x + 0.5 * t; }, 2, 2, {0, kNsPerSecond});
    ASSERT_EQ(frames.size(), 999U);
    const double exposure = to_seconds(frames[700].exposure) / 0.0005;
    EXPECT_NEAR(irradiance(frames[700].numbers(1, 0)), exposure * (0.3 + 0.5 * 0.701), 2 * kQuantum);
    if (automatic) {
      EXPECT_NEAR(exposure, 0.2 / (0.25 + 0.5 * 0.699), 1e-4);
    }
  }
}

TEST(FrameCamera, ExposesRowsOneAfterTheOther) {
  // On a ramp, each row's value is its time.
  FrameCameraOptions options = precise(20, 0.01);
  options.line_delay_s = 0.0005;
  constexpr int kHeight = 48;
  FrameCamera camera(options, 2, kHeight, {0, 200 * kNsPerMs});
  const auto frames = show(
      camera, [](int, int, double t) { return 5 * t; }, 2, kHeight, every(kNsPerMs, 200 * kNsPerMs));
  ASSERT_EQ(frames.size(), 3U);
  for (const CameraFrame& frame : frames) {
    for (int y = 0; y < kHeight; ++y) {
      const double middle_s = to_seconds(frame.t) + (y - 23.5) * 0.0005;
      EXPECT_NEAR(irradiance(frame.numbers(0, y)), 5 * middle_s, kQuantum) << y;
    }
    EXPECT_EQ(frame.exposure_start, frame.t - 5 * kNsPerMs - 11'750'000);
    EXPECT_EQ(frame.exposure_end, frame.t + 5 * kNsPerMs + 11'750'000);
  }
}

TEST(FrameCamera, KeepsExposuresApartThatOverlapInTime) {
  // Reading and exposure each take the whole interval: the first rows of a frame begin long before the last rows of the
  // previous frame end.
  FrameCameraOptions options = precise(100, 0.01);
  options.line_delay_s = 0.01 / 40;
  FrameCamera camera(options, 2, 40, {0, 100 * kNsPerMs});
  const auto frames = show(
      camera, [](int, int, double t) { return 9 * t; }, 2, 40, every(700'000, 100 * kNsPerMs));
  ASSERT_EQ(frames.size(), 9U);
  EXPECT_LT(frames[1].exposure_start, frames[0].exposure_end);
  for (const CameraFrame& frame : frames) {
    for (int y = 0; y < 40; ++y)
      EXPECT_NEAR(irradiance(frame.numbers(1, y)), 9 * (to_seconds(frame.t) + (y - 19.5) * 0.00025), kQuantum);
  }
}

/// All digital numbers of a frame with uniform irradiance.
std::vector<std::uint16_t> numbers_of(const FrameCameraOptions& options, double light, int width = 64, int height = 64,
                                      std::uint64_t seed = 0, std::uint16_t stream = 0, std::size_t frame = 0,
                                      const Workers& workers = kOneThread) {
  FrameCamera camera(options, width, height, {0, 200 * kNsPerMs}, seed, stream);
  const auto frames = show(
      camera, [&](int, int, double) { return light; }, width, height, {0, 200 * kNsPerMs}, workers);
  const auto pixels = frames.at(frame).numbers.pixels();
  return {pixels.begin(), pixels.end()};
}

struct Moments {
  double mean = 0, variance = 0, third = 0;
};
Moments moments(const std::vector<std::uint16_t>& numbers) {
  Moments m;
  const auto n = static_cast<double>(numbers.size());
  for (const auto number : numbers) m.mean += number / n;
  for (const auto number : numbers) {
    const double d = number - m.mean;
    m.variance += d * d / n, m.third += d * d * d / n;
  }
  return m;
}

TEST(FrameCamera, SaturatesAtTheFullWellAndAtFullScale) {
  FrameCameraOptions options;
  options.saturation_irradiance = 0.5;
  EXPECT_EQ(numbers_of(options, 0.25)[0], 128);
  EXPECT_EQ(numbers_of(options, 0.5)[0], 255);
  EXPECT_EQ(numbers_of(options, 1e30)[0], 255);
  options.gain = 0.5;
  EXPECT_EQ(numbers_of(options, 100)[0], 128) << "the pixel is full at half the scale";
  options.gain = 2;
  EXPECT_EQ(numbers_of(options, 0.125)[0], 128);
  EXPECT_EQ(numbers_of(options, 0.3)[0], 255);
}

TEST(FrameCamera, AddsTheBlackLevel) {
  FrameCameraOptions options;
  options.bits = 12;
  options.black_level = 95;
  EXPECT_EQ(numbers_of(options, 0)[0], 95);
  EXPECT_EQ(numbers_of(options, 0.5)[0], 2095);
  EXPECT_EQ(numbers_of(options, 1)[0], 4095);
  options.read_noise_e = 40;  // 16 DN
  const Moments dark = moments(numbers_of(options, 0));
  EXPECT_NEAR(dark.mean, 95, 1.5) << "noise below the black level is not clipped";
  EXPECT_NEAR(std::sqrt(dark.variance), 16, 0.8);
}

TEST(FrameCamera, FollowsThePhotonTransferCurve) {
  // variance = K (mean - black) + (K read)^2 + 1/12, with K DN per electron.
  FrameCameraOptions options;
  options.bits = 12;
  options.black_level = 95;
  options.full_well_e = 8000;
  options.gain = 1.5;
  options.shot_noise = true;
  options.read_noise_e = 4;
  const double K = 1.5 * 4000 / 8000, n = 256.0 * 256.0;
  for (const double light : {0.0005, 0.004, 0.009, 0.05, 0.3, 0.6}) {
    const Moments m = moments(numbers_of(options, light, 256, 256, 3));
    const double expected = 95 + K * 8000 * light;
    const double variance = K * (expected - 95) + K * K * 16 + 1.0 / 12;
    EXPECT_NEAR(m.mean, expected, 5 * std::sqrt(variance / n)) << light;
    EXPECT_NEAR(m.variance / variance, 1, 5 * std::sqrt(2 / n)) << light;
  }
}

TEST(FrameCamera, CountsElectronsAsPoissonDid) {
  // One DN per electron: mean, variance and third moment are equal, also at low irradiance.
  FrameCameraOptions options;
  options.bits = 16;
  options.full_well_e = 65535;
  options.shot_noise = true;
  for (const double electrons : {0.3, 3.0, 40.0, 63.9, 64.1, 300.0}) {
    const Moments m = moments(numbers_of(options, electrons / 65535, 256, 256, 7));
    const double n = 256.0 * 256.0;
    EXPECT_NEAR(m.mean, electrons, 5 * std::sqrt(electrons / n)) << electrons;
    EXPECT_NEAR(m.variance, electrons, 5 * std::sqrt((electrons + 2 * electrons * electrons) / n)) << electrons;
    // The variance of a third central moment: mu6 - mu3^2 - 6 mu4 mu2 + 9 mu2^3.
    const double l = electrons, mu4 = l + 3 * l * l, mu6 = l + 25 * l * l + 15 * l * l * l;
    EXPECT_NEAR(m.third, l, 5 * std::sqrt((mu6 - l * l - 6 * mu4 * l + 9 * l * l * l) / n)) << electrons;
  }
}

TEST(FrameCamera, HasNoiseOfItsOwnInEachPixelFrameCameraAndSeed) {
  FrameCameraOptions options = precise(100, 0.01);
  options.shot_noise = true;
  options.read_noise_e = 5;
  const auto base = numbers_of(options, 0.4, 64, 64, 1, 0, 0);
  EXPECT_EQ(numbers_of(options, 0.4, 64, 64, 1, 0, 0), base);
  const double spread = moments(base).variance;
  EXPECT_GT(spread, 1000);
  const std::vector<std::vector<std::uint16_t>> others = {numbers_of(options, 0.4, 64, 64, 2, 0, 0),
                                                          numbers_of(options, 0.4, 64, 64, 1, 1, 0),
                                                          numbers_of(options, 0.4, 64, 64, 1, 0, 1),
                                                          {base.rbegin(), base.rend()}};
  for (const auto& other : others) {
    double covariance = 0;
    const double mean = moments(base).mean, other_mean = moments(other).mean;
    for (std::size_t i = 0; i < base.size(); ++i)
      covariance += (base[i] - mean) * (other[i] - other_mean) / static_cast<double>(base.size());
    EXPECT_LT(std::fabs(covariance), 5 * spread / 64) << "correlated";
  }
}

TEST(FrameCamera, SharesNothingWithAnotherCamera) {
  FrameCameraOptions options = precise(50, 0.007);
  options.shot_noise = true;
  options.auto_exposure = AutoExposureOptions{};
  const auto times = every(kNsPerMs, 200 * kNsPerMs);
  FrameCamera alone(options, 8, 8, {0, 200 * kNsPerMs}, 1, 0);
  const auto expected = show(alone, waves, 8, 8, times);
  // The same if it alternates with another camera.
  FrameCamera first(options, 8, 8, {0, 200 * kNsPerMs}, 1, 0), second(options, 8, 8, {0, 200 * kNsPerMs}, 1, 1);
  std::vector<CameraFrame> frames;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    for (FrameCamera* camera : {&second, &first}) {
      const Light light = camera == &first ? Light(waves) : [](int x, int, double) { return 0.1 * x; };
      const auto taken = show(*camera, light, 8, 8, {times[i], times[i + 1]});
      if (camera == &first) frames.insert(frames.end(), taken.begin(), taken.end());
    }
  }
  ASSERT_EQ(frames.size(), expected.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(frames[k].exposure, expected[k].exposure);
    EXPECT_TRUE(std::ranges::equal(frames[k].numbers.pixels(), expected[k].numbers.pixels()));
  }
}

TEST(FrameCamera, GivesTheSameWithAnyNumberOfThreads) {
  FrameCameraOptions options;
  options.shot_noise = true;
  options.read_noise_e = 10;
  options.response = GammaResponse{};
  const Workers three(3);
  EXPECT_EQ(numbers_of(options, 0.2, 211, 173, 1, 0, 1, three), numbers_of(options, 0.2, 211, 173, 1, 0, 1));
}

TEST(FrameCamera, AdaptsItsExposureToTheLight) {
  for (const ResponseOptions& response : {ResponseOptions{}, ResponseOptions{GammaResponse{2.2}}}) {
    FrameCameraOptions options = precise(50, 0.002);
    options.response = response;
    options.black_level = 1000;
    options.auto_exposure = AutoExposureOptions{.target = 0.3, .min_exposure_s = 2e-5, .max_exposure_s = 0.015};
    FrameCamera camera(options, 16, 16, {0, 2 * kNsPerSecond});
    // Uniform irradiance, first too dark, then too bright: 25 frames each.
    const Light light = [](int, int, double t) { return t < 0.51 ? 0.1 : (t < 1.01 ? 2 : (t < 1.51 ? 1e4 : 1e-4)); };
    const auto frames = show(camera, light, 16, 16, every(kNsPerMs, 2 * kNsPerSecond));
    ASSERT_EQ(frames.size(), 99U);
    const auto level = [&](std::size_t k) { return (frames[k].numbers(3, 3) - 1000.0) / 64535; };
    EXPECT_EQ(frames[0].exposure, 2 * kNsPerMs);
    EXPECT_EQ(frames[1].exposure, 2 * kNsPerMs) << "an exposure depends on that of two frames earlier";
    EXPECT_NE(frames[2].exposure, 2 * kNsPerMs);
    for (const std::size_t k : {10U, 20U, 40U, 48U}) EXPECT_NEAR(level(k), 0.3, 0.001) << k;
    EXPECT_EQ(frames[70].exposure, 20'000) << "the shortest";
    EXPECT_EQ(frames[95].exposure, 15 * kNsPerMs) << "the longest";
  }
}

TEST(FrameCamera, RefusesInvalidIrradiance) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -0.1}) {
    const Light light = [&](int x, int y, double t) {
      return x == 2 && y == 1 && t > 0.0095 && t < 0.0105 ? bad : 0.5;
    };
    FrameCamera camera(precise(100, 0.004), 9, 2, {0, 50 * kNsPerMs});
    const auto times = every(kNsPerMs, 50 * kNsPerMs);
    const std::string message = message_of<UserError>([&] { show(camera, light, 9, 2, times); });
    EXPECT_TRUE(contains(message, "pixel (2, 1)")) << message;
    EXPECT_TRUE(contains(message, "t = 0.010000 s")) << message;
    EXPECT_TRUE(contains(message_of<UserError>([&] { show(camera, light, 9, 2, times); }), "cannot go on"));
  }
}

TEST(FrameCamera, RefusesInvalidIrradianceAheadOfItsTime) {
  // A tile is so far ahead that the exposures are not known yet.
  FrameCameraOptions options = precise(100, 0.004);
  options.auto_exposure = AutoExposureOptions{};
  FrameCamera camera(options, 4, 4, {0, kNsPerSecond});
  Image<float> good(4, 4, 0.5F), bad = good;
  bad(1, 0) = std::nanf("");
  const Tile tile{0, 0, 2, 2};
  const std::vector<Segment> first = {{tile, 0, 0, &good, &good}, {tile, 0, 60 * kNsPerMs, &good, &good}};
  camera.integrate(first, 0, kOneThread);
  const Segment next{tile, 60 * kNsPerMs, 70 * kNsPerMs, &good, &bad};
  EXPECT_TRUE(contains(message_of<UserError>([&] { camera.integrate({&next, 1}, 0, kOneThread); }), "pixel (1, 0)"));
  EXPECT_TRUE(contains(message_of<UserError>([&] { camera.integrate(first, 0, kOneThread); }), "cannot go on"));
}

TEST(FrameCamera, RefusesOptionsThatContradictEachOther) {
  const auto message = [](const FrameCameraOptions& options) {
    return message_of<UserError>([&] { FrameCamera(options, 32, 100, {0, kNsPerSecond}); });
  };
  EXPECT_TRUE(contains(message({.rate_hz = 100, .exposure_s = 0.02}), "frame_camera.exposure_s: 0.02 s is longer"));
  EXPECT_TRUE(contains(message({.rate_hz = 100, .line_delay_s = 0.0002}), "frame_camera.line_delay_s: 100 rows"));
  EXPECT_TRUE(contains(message({.black_level = 255}), "frame_camera.black_level"));
  EXPECT_TRUE(contains(message({.rate_hz = 100, .auto_exposure = AutoExposureOptions{.max_exposure_s = 0.02}}),
                       "frame_camera.auto_exposure.max_exposure_s"));
  EXPECT_TRUE(contains(message({.auto_exposure = AutoExposureOptions{.min_exposure_s = 0.01, .max_exposure_s = 0.001}}),
                       "frame_camera.auto_exposure.min_exposure_s"));
  EXPECT_TRUE(contains(message({.exposure_s = 0.02, .auto_exposure = AutoExposureOptions{.max_exposure_s = 0.015}}),
                       "frame_camera.exposure_s"));
  EXPECT_TRUE(contains(message({.response = MeasuredResponse{}}), "frame_camera.response.path"));
  EXPECT_EQ(message({.rate_hz = 30, .exposure_s = 1.0 / 30, .line_delay_s = 1.0 / 3000}), "nothing was thrown");
}

class ResponseFile : public testing::Test {
 protected:
  CameraResponse read(const std::string& text) {
    std::ofstream(path()) << text;
    return CameraResponse(MeasuredResponse{path()});
  }
  std::string error(const std::string& text) {
    return message_of<UserError>([&] { read(text); });
  }
  static float level(const CameraResponse& response, float signal) {
    response.apply({&signal, 1});
    return signal;
  }
  std::filesystem::path path() const { return folder_.path() / "response.csv"; }

  test::TemporaryDirectory folder_;
};

TEST_F(ResponseFile, IsInterpolatedBetweenItsLines) {
  for (const std::string& text : {std::string("signal, level\n# measured\n\n0, 0\n50,100\r\n100, 100\n200, 250\n"),
                                  std::string("0 0\n0.5\t1\n  1 1\n2 2.5")}) {
    const CameraResponse response = read(text);
    EXPECT_FLOAT_EQ(level(response, 0), 0);
    EXPECT_FLOAT_EQ(level(response, 0.125F), 0.2F);
    EXPECT_FLOAT_EQ(level(response, 0.4F), 0.4F);
    EXPECT_FLOAT_EQ(level(response, 0.75F), 0.7F);
    EXPECT_FLOAT_EQ(level(response, 1), 1);
    EXPECT_FLOAT_EQ(level(response, 7), 1);
    EXPECT_FLOAT_EQ(level(response, -1), 0);
    for (const double wanted : {0.1, 0.3, 0.5, 0.9}) {
      const auto signal = static_cast<float>(response.inverse(wanted));
      EXPECT_NEAR(level(response, signal), wanted, 1e-6);
    }
  }
}

TEST_F(ResponseFile, IsRefusedWhereItIsNone) {
  EXPECT_TRUE(contains(error("0 0\n0.5 0.6\n1 0.4\n"), "response.csv:3: the level must not fall"));
  EXPECT_TRUE(contains(error("0 0\n0.5 0.6\n0.5 0.7\n"), "response.csv:3: the signal must rise"));
  EXPECT_TRUE(contains(error("0 0\nabc\n"), "response.csv:2: a line"));
  EXPECT_TRUE(contains(error("0 0\n1 2 3\n"), "response.csv:2: a line"));
  EXPECT_TRUE(contains(error("0 0\n1 nan\n"), "response.csv:2: a line"));
  EXPECT_TRUE(contains(error("-1 0\n1 1\n"), "response.csv:1: signal and level must not be below 0"));
  EXPECT_TRUE(contains(error("0 0.5\n1 0.5\n"), "at least two lines"));
  EXPECT_TRUE(contains(error(""), "at least two lines"));
  EXPECT_TRUE(contains(message_of<UserError>([&] { CameraResponse(MeasuredResponse{folder_.path() / "no.csv"}); }),
                       "no.csv: cannot be read"));
}

TEST(CameraResponse, OfGammaIsAPower) {
  const CameraResponse response(GammaResponse{2});
  std::vector<float> signal = {-0.5F, 0, 0.25F, 1};
  response.apply(signal);
  EXPECT_EQ(signal, (std::vector<float>{0, 0, 0.5F, 1}));
  EXPECT_DOUBLE_EQ(response.inverse(0.5), 0.25);
}

}  // namespace
}  // namespace esim
