// Sensors against "real" recordings that are simulated here, so that the right answer is known.
#include "esim/evaluate/realism/realism.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/evaluate/realism/real_frame.h"
#include "esim/evaluate/realism/real_recordings.h"
#include "esim/event_camera/event_camera.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/files/npy_header.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 64, kHeight = 48;

void write_file(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

std::string npy_of(const std::vector<std::uint64_t>& shape, const std::vector<double>& values) {
  std::string bytes = npy::header_text("'<f8'", shape);
  bytes.append(reinterpret_cast<const char*>(values.data()), 8 * values.size());
  return bytes;
}

/// A clip of 50 ms in which a random texture moves by 6 px to the right and 3 px upwards, without events.
void write_scene(const fs::path& folder) {
  fs::create_directories(folder);
  std::mt19937 random(1);
  std::vector<std::uint8_t> grey(kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      grey[static_cast<std::size_t>(y * kWidth + x)] =
          static_cast<std::uint8_t>(120 + 80 * std::sin(0.5 * x + 0.2 * y) + static_cast<double>(random() % 40));
  }
  write_file(folder / "frame.png", encode_png({grey.data(), kWidth, kWidth, kHeight}, PngEffort::small));
  std::vector<double> flow(2 * kWidth * kHeight, 6.0);
  std::fill(flow.begin() + kWidth * kHeight, flow.end(), -3.0);
  write_file(folder / "flow.npy", npy_of({1, 2, kHeight, kWidth}, flow));
}

EventCameraOptions usual_sensor() {
  EventCameraOptions options;
  options.contrast_threshold = 0.2;
  options.threshold_mismatch = 0.02;
  options.refractory_period_us = 300;
  return options;
}

/// Records the clip's own scene with a sensor.
void record(const fs::path& folder, const EventCameraOptions& options) {
  write_file(folder / "events.txt", "10.0 0 0 1\n10.05 0 0 1\n");
  const RealClip clip = read_real_clip(folder);
  EventCamera camera(options, kWidth, kHeight, 77);
  const Workers workers(1);
  std::vector<Event> events;
  for (int k = -20; k <= 200; ++k) {
    camera.process(clip.image_at(k * 2.5e-4), to_ns(10 + k * 2.5e-4), events, workers);
    if (k == 0) events.clear();
  }
  std::string text;
  char line[80];
  for (const Event& e : events) {
    std::snprintf(line, sizeof line, "%.9f %d %d %d\n", to_seconds(e.t), e.x, e.y, e.polarity > 0 ? 1 : 0);
    text += line;
  }
  write_file(folder / "events.txt", text);
}

TEST(Realism, TheFrameMovesAlongTheFlow) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path());
  write_file(folder.path() / "events.txt", "1.0 5 6 1\n1.1 5 6 0\n");
  const RealClip clip = read_real_clip(folder.path());
  EXPECT_DOUBLE_EQ(clip.duration_s, 0.1);
  EXPECT_EQ(clip.events.front().t, 0);
  const Image<float> middle = clip.image_at(0.05), end = clip.image_at(0.1), begin = clip.image_at(0);
  for (int y = 8; y < kHeight - 8; ++y) {
    for (int x = 8; x < kWidth - 8; ++x) {
      EXPECT_NEAR(middle(x, y), clip.frame.scene(x, y) * clip.frame.vignetting(x, y), 1e-6F);
      // Half of (6, -3) px before and after the middle: whole pixels in x, half pixels in y. Vignetting does not move.
      const Image<float>& vignetting = clip.frame.vignetting;
      EXPECT_NEAR(begin(x - 6, y + 3) / vignetting(x - 6, y + 3), end(x, y) / vignetting(x, y), 1e-6F);
    }
  }
}

/// A black square on grey, under a lens that darkens the corners, with noise and a black line at the border.
TEST(Realism, FramesLoseBorderVignettingAndNoise) {
  constexpr int kSize = 100;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1.5);
  const auto vignetting = [](int x, int y) {
    const double u = 2.0 * x / kSize - 1, v = 2.0 * y / kSize - 1;
    return std::exp(-0.2 * (u * u + v * v) + 0.1 * u);
  };
  const auto is_black = [](int x, int y) { return x >= 30 && x < 60 && y >= 40 && y < 70; };
  std::vector<std::uint8_t> grey(kSize * kSize);
  for (int y = 1; y < kSize - 1; ++y) {
    for (int x = 1; x < kSize - 1; ++x)
      grey[static_cast<std::size_t>(y * kSize + x)] = static_cast<std::uint8_t>(
          std::clamp((is_black(x, y) ? 10 : 150) * vignetting(x, y) + noise(random), 0.0, 255.0));
  }
  const test::TemporaryDirectory folder;
  write_file(folder.path() / "frame.png", encode_png({grey.data(), kSize, kSize, kSize}, PngEffort::small));
  const RealFrame frame = read_real_frame(folder.path() / "frame.png", kSize, kSize);
  const float middle = frame.scene(80, 20);
  double squares = 0, pixels = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      EXPECT_NEAR(frame.vignetting(x, y) / vignetting(x, y), 1, 0.02) << x << ' ' << y;
      if (is_black(x, y)) {
        EXPECT_LT(frame.scene(x, y), 0.15F * middle) << x << ' ' << y;
      } else {
        EXPECT_NEAR(frame.scene(x, y) / middle, 1, 0.03) << x << ' ' << y;
        squares += std::pow(static_cast<double>(frame.scene(x, y) / middle) - 1, 2), ++pixels;
      }
    }
  }
  EXPECT_LT(std::sqrt(squares / pixels), 0.004);  // 1.5 / 150 before
}

TEST(Realism, TimesAreWholeMicrosecondsButForRounding) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path());
  write_file(folder.path() / "events.txt", "0.0 1 1 1\n0.6367649989999999 5 6 1\n0.700001001 5 6 0\n");
  EXPECT_EQ(read_real_clip(folder.path()).events[1].t, 636'765'000);
  EXPECT_EQ(read_real_clip(folder.path()).events[2].t, 700'001'000);
  write_file(folder.path() / "events.txt", "0.0 1 1 1\n0.6367649989999999 5 6 1\n0.700001300 5 6 0\n");
  EXPECT_EQ(read_real_clip(folder.path()).events[2].t, 700'001'300);
}

TEST(Realism, TheSensorThatRecordedIsTheNearest) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path() / "clip");
  record(folder.path() / "clip", usual_sensor());
  EventCameraOptions higher = usual_sensor(), slower = usual_sensor();
  higher.contrast_threshold = 0.3;
  slower.refractory_period_us = 3000;
  const RealismEvaluation found = evaluate_realism(
      folder.path(), {{"usual", usual_sensor(), {}}, {"higher", higher, {}}, {"slower", slower, {}}}, {}, {});
  ASSERT_EQ(found.clips.size(), 3U);
  EXPECT_LT(found.clips[0].sum_of_deviations(), 25);  // 20 statistics of equal sensors: 0.8 each
  EXPECT_GT(found.clips[1].sum_of_deviations(), 2 * found.clips[0].sum_of_deviations());
  EXPECT_GT(found.clips[2].sum_of_deviations(), 2 * found.clips[0].sum_of_deviations());
  EXPECT_TRUE(distinguishing(found.clips[0].statistics).empty());
  EXPECT_TRUE(test::contains(describe(found), "| sum of deviations"));
  EXPECT_TRUE(test::contains(to_json(found), "\"model\": \"slower\""));
}

TEST(Realism, SensorsAreFittedToAPartAndJudgedByTheRest) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path() / "clip");
  record(folder.path() / "clip", usual_sensor());
  const RealClip clip = read_real_clip(folder.path() / "clip");
  const RealClip begin = clip.part(0, 0.4), rest = clip.part(0.4, 1);
  EXPECT_EQ(begin.events.size() + rest.events.size(), clip.events.size());
  const Image<float> here = rest.image_at(0.003), there = clip.image_at(0.4 * clip.duration_s + 0.003);
  for (std::size_t i = 0; i < here.size(); ++i) ASSERT_NEAR(here.pixels()[i], there.pixels()[i], 1e-6F);

  EventCameraOptions other = usual_sensor();
  other.contrast_threshold_on = 0.35, other.contrast_threshold_off = 0.12, other.refractory_period_us = 2000;
  RealismOptions options;
  options.fit_to = ClipPart{"clip", 0, 0.4};
  const RealismEvaluation found = evaluate_realism(folder.path(), {{"other", other, {}}}, options, {});
  ASSERT_EQ(found.clips.size(), 2U);
  ASSERT_EQ(found.fitted.size(), 1U);
  const auto expect_truth = [&](const char* name, double truth, double tolerance) {
    for (const Estimate& e : found.fitted[0].fit.estimates) {
      if (e.name != name) continue;
      ASSERT_TRUE(e.determined()) << e.reason;
      EXPECT_NEAR(e.value, truth, tolerance) << name;
      EXPECT_TRUE(e.low <= truth && truth <= e.high) << name << ": " << e.low << " to " << e.high;
    }
  };
  expect_truth("contrast_threshold_on", 0.2, 0.01);  // other pixels than those that recorded
  expect_truth("contrast_threshold_off", 0.2, 0.01);
  expect_truth("refractory_period_us", 300, 400);  // few intervals are that short
  EXPECT_LT(found.clips[1].sum_of_deviations(), 25);
  EXPECT_GT(found.clips[0].sum_of_deviations(), 2 * found.clips[1].sum_of_deviations());
  EXPECT_TRUE(test::contains(describe(found), "leak_rate_hz: not determined, because areas without motion"));
  EXPECT_TRUE(test::contains(to_json(found), "\"name\": \"refractory_period_us\""));
  const auto message = [&](const ClipPart& part) {
    options.fit_to = part;
    return test::message_of<UserError>([&] { evaluate_realism(folder.path(), {{"other", other, {}}}, options, {}); });
  };
  EXPECT_TRUE(test::contains(message({"none", 0, 0.5}), "no clip none"));
  EXPECT_TRUE(test::contains(message({"clip", 0, 1}), "not to all of it"));
  EXPECT_TRUE(test::contains(message({"clip", 0.2, 0.5}), "not to all of it"));
}

/// The readout of a circuit is found again, from a base that has none.
TEST(Realism, AReadoutOfRowsIsFitted) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path() / "clip");
  EventCameraOptions sensor = preset_options("davis240c");
  sensor.contrast_threshold = 0.1, sensor.hot_pixels = 0, sensor.circuit->noise = 0;
  sensor.readout = {};
  sensor.readout.time_stamp_us = 1, sensor.readout.row_wait_us = 10;
  record(folder.path() / "clip", sensor);
  EventCameraOptions base = sensor;
  base.readout = {};
  RealismOptions options;
  options.frame_step_s = 1e-3, options.history_s = 0.03;
  options.fit_to = ClipPart{"clip", 0, 0.6};
  const RealismEvaluation found = evaluate_realism(folder.path(), {{"base", base, {}}}, options, {});
  const ReadoutOptions& readout = found.fitted.at(0).fit.options.readout;
  EXPECT_EQ(readout.time_stamp_us, 1);
  EXPECT_NEAR(readout.row_wait_us, 10, 4);
  EXPECT_LT(found.clips[1].sum_of_deviations(), 0.7 * found.clips[0].sum_of_deviations());
}

/// The frames that the chip takes are found in the recording, and their coupling is fitted to the bursts of events.
TEST(Realism, TheCouplingOfFramesIsFitted) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path() / "clip");
  constexpr double kCoupling = 0.04;
  EventCameraOptions sensor = preset_options("davis240c");
  sensor.contrast_threshold = 0.2, sensor.hot_pixels = 0, sensor.readout = {};
  CircuitOptions& circuit = *sensor.circuit;
  circuit.noise = 0, circuit.frame_coupling = kCoupling;
  // The camera starts 5 ms before the clip, in which exposures are from 7 to 13 and from 32 to 38 ms.
  circuit.frame_rate_hz = 40, circuit.frame_exposure_ms = 6, circuit.frame_offset_ms = 15;
  record(folder.path() / "clip", sensor);
  const std::optional<FrameTimes> frames = read_real_clip(folder.path() / "clip").frames;
  ASSERT_TRUE(frames && frames->period && frames->exposure());
  EXPECT_NEAR(to_seconds(*frames->period), 0.025, 2e-4);
  EXPECT_NEAR(to_seconds(*frames->exposure()), 0.006, 2e-4);
  EXPECT_NEAR(to_seconds(*frames->end), 0.013, 2e-4);

  EventCameraOptions base = sensor;
  base.circuit->frame_coupling = 0, base.circuit->frame_offset_ms = 0, base.circuit->frame_rate_hz.reset();
  base.contrast_threshold = 0.25;
  RealismOptions options;
  options.frame_step_s = 1e-3, options.history_s = 0.03;
  options.fit_to = ClipPart{"clip", 0, 0.5};
  const RealismEvaluation found = evaluate_realism(folder.path(), {{"base", base, {}}}, options, {});
  const std::vector<Estimate>& estimates = found.fitted.at(0).fit.estimates;
  const auto coupling = std::find_if(estimates.begin(), estimates.end(),
                                     [](const Estimate& e) { return e.name == "circuit.frame_coupling"; });
  ASSERT_TRUE(coupling != estimates.end() && coupling->determined()) << coupling->reason;
  EXPECT_TRUE(coupling->low <= kCoupling && kCoupling <= coupling->high) << coupling->low << " to " << coupling->high;
  EXPECT_NEAR(coupling->value, kCoupling, 0.01);
  EXPECT_EQ(found.fitted[0].fit.options.circuit->frame_coupling, coupling->value);
  EXPECT_TRUE(test::contains(describe(found), "clip: frames every 25.0 ms, exposed for 6.0")) << describe(found);
}

TEST(Realism, APartWithFewEventsDeterminesNothing) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path() / "clip");
  write_file(folder.path() / "clip" / "events.txt", "1.0 5 6 1\n1.01 7 6 0\n1.05 5 6 1\n");
  RealismOptions options;
  options.fit_to = ClipPart{"clip", 0, 0.5};
  const RealismEvaluation found = evaluate_realism(folder.path(), {{"usual", usual_sensor(), {}}}, options, {});
  for (const Estimate& e : found.fitted.at(0).fit.estimates) {
    EXPECT_FALSE(e.determined()) << e.name;
    EXPECT_TRUE(test::contains(e.reason, "1 ON and 1 OFF events")) << e.reason;
  }
  EXPECT_EQ(found.fitted[0].fit.options.threshold_on(), usual_sensor().threshold_on());
}

TEST(Realism, OtherProgramsGetTheFramesAndWriteEvents) {
  const test::TemporaryDirectory folder;
  write_scene(folder.path());
  record(folder.path(), usual_sensor());
  // This program writes the real events, 2 s later: its history begin there.
  const std::string script =
      "test -f {frames}/00000.png && test -f {frames}/images.csv && awk '{print $1 - 10 + 2, "
      "$2, $3, $4}' '" +
      (folder.path() / "events.txt").string() + "' > {events}";
  const RealismEvaluation found = evaluate_realism(folder.path(), {{"copy", {}, script}}, {}, {});
  for (const ComparedStatistic& statistic : found.clips.at(0).statistics) {
    if (statistic.name == "ON fraction" || statistic.name == "next event of the same polarity") {
      EXPECT_NEAR(statistic.distance, 0, 0.01) << statistic.name;
    }
  }
  const std::string problem = test::message_of<UserError>([&] {
    evaluate_realism(folder.path(), {{"bad", {}, "exit 3"}}, {}, {});
  });
  EXPECT_TRUE(test::contains(problem, "the command of bad failed with status 3"));
}

TEST(Realism, NoiseIsComparedByRates) {
  const test::TemporaryDirectory folder;
  // 20 x 20 pixels; each has n ON events at 2 Hz with intervals of 1/2 s, and no OFF events.
  std::vector<double> on(20 * 20 * 72), off(20 * 20 * 72);
  for (std::size_t pixel = 0; pixel < 400; ++pixel) {
    for (std::size_t k = 0; k < 71; ++k) on[pixel * 72 + k] = k >= 28 ? 19.0 : 0.0;  // below 3 Hz
  }
  write_file(folder.path() / "noise_pos_5lux.npy", npy_of({20, 20, 72}, on));
  write_file(folder.path() / "noise_neg_5lux.npy", npy_of({20, 20, 72}, off));
  const RealNoise noise = read_real_noise(folder.path() / "noise_pos_5lux.npy");
  EXPECT_EQ(noise.lux, 5);
  EXPECT_EQ(noise.on.counts.quantile(0.5), 19);
  EXPECT_EQ(noise.off.counts.quantile(1), 0);
  for (std::size_t k = 0; k < 71; ++k) EXPECT_EQ(noise.on.fraction[k], noise.on.rates_hz[k] > 2.5 ? 1.0 : 0.0) << k;

  EventCameraOptions leaky;
  leaky.leak_rate_hz = 2.2;
  const RealismEvaluation found = evaluate_realism(folder.path(), {{"leaky", leaky, {}}}, {}, {});
  ASSERT_EQ(found.noise.size(), 1U);
  EXPECT_NEAR(found.noise[0].on, 22, 0.5);
  EXPECT_EQ(found.noise[0].off, 0);
  EXPECT_EQ(found.noise[0].ks_counts_off, 0);
  EXPECT_EQ(found.noise[0].ks_counts_on, 1);     // 22 is not 19
  EXPECT_EQ(found.noise[0].ks_intervals_on, 0);  // both between 2 and 3 Hz
  EXPECT_TRUE(std::isnan(found.noise[0].ks_intervals_off));
}

TEST(Realism, RefusesWhatIsNoRecording) {
  const test::TemporaryDirectory folder;
  const auto refusal = [&] { return test::message_of<UserError>([&] { read_real_recordings(folder.path()); }); };
  EXPECT_TRUE(test::contains(refusal(), "contains neither folders with events.txt"));
  write_scene(folder.path());
  write_file(folder.path() / "events.txt", "1.0 5 6 1\n");
  EXPECT_TRUE(test::contains(refusal(), "holds no span of time"));
  write_file(folder.path() / "events.txt", "1.0 5 6 1\n1.1 900 6 1\n");
  EXPECT_NE(refusal(), "nothing was thrown");
  write_file(folder.path() / "events.txt", "1.0 5 6 1\n1.1 5 6 1\n");
  write_file(folder.path() / "flow.npy", npy_of({1, 2, kHeight, kWidth}, std::vector<double>(100)));
  EXPECT_TRUE(test::contains(refusal(), "it ends before its last number"));
  write_file(folder.path() / "flow.npy", npy_of({2, kHeight}, std::vector<double>(2 * kHeight)));
  EXPECT_TRUE(test::contains(refusal(), "its shape must be (1, 2, height, width)"));
  write_scene(folder.path());
  fs::copy(folder.path() / "frame.png", folder.path() / "other.png");
  EXPECT_TRUE(test::contains(refusal(), "must contain one PNG file only"));
  fs::remove(folder.path() / "other.png");
  write_file(folder.path() / "frame.png", "no image");
  EXPECT_TRUE(test::contains(refusal(), "must be a PNG image of 8 bits"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([&] { read_real_noise(folder.path() / "noise_pos_lux.npy"); }),
                             "NUMBERlux"));
}

}  // namespace
}  // namespace esim
