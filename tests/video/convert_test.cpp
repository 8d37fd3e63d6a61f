#include "esim/sim/convert.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "esim/core/error.h"
#include "esim/frame_camera/bayer.h"
#include "support/errors.h"
#include "support/temporary_directory.h"
#include "video/videos.h"

namespace esim {
namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr TimeNs kPeriod = 40 * kNsPerMs;

const test::Pattern kPattern(4);

/// Keeps all records.
struct Memory final : Sink {
  void begin(const RecordingInfo& given) override { info = given; }
  void write(const Record& record) override {
    if (const auto* some = std::get_if<EventsRecord>(&record)) {
      events.insert(events.end(), some->events.begin(), some->events.end());
    } else if (const auto* image = std::get_if<ImageRecord>(&record)) {
      EXPECT_TRUE(events.empty() || events.back().t <= image->t);
      image_times.push_back(image->t);
    }
  }
  void end(bool whole) override { complete = whole; }

  std::optional<RecordingInfo> info;
  std::vector<Event> events;
  std::vector<TimeNs> image_times;
  std::optional<bool> complete;
};

struct Settings {
  InterpolationOptions interpolation{};
  bool colour = false;
  int threads = 1;
  Monitor monitor = [](const Progress&) { return true; };
};

ConversionSummary convert_folder(const std::filesystem::path& folder, Sink& out, const Settings& settings = {}) {
  FrameSequence frames(folder, {.fps = 25}, settings.colour);
  const EventCameraOptions options{.contrast_threshold = 0.2};
  Interpolator interpolator(settings.interpolation, options.log_eps);
  EventCamera event_camera(options, frames.width(), frames.height(), 0, 0);
  const Workers workers(settings.threads);
  return convert({frames, interpolator, event_camera, workers}, out, settings.monitor);
}

class ConvertTest : public testing::Test {
 protected:
  /// A pattern that moves by `speed` px per frame, as 16-bit images.
  void write_frames(int count, double speed, double brighter_per_frame = 0) {
    for (int i = 0; i < count; ++i) {
      cv::Mat image(kHeight, kWidth, CV_16UC3);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const double light = 0.25 * kPattern(x - speed * i, y - 0.4 * speed * i) * std::exp(brighter_per_frame * i);
          const double code = light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
          const auto grey = static_cast<std::uint16_t>(std::clamp(65535 * code, 0.0, 65535.0));
          image.at<cv::Vec3w>(y, x) = {grey, grey, grey};
        }
      }
      cv::imwrite((path() / (std::to_string(i) + ".png")).string(), image);
    }
  }
  const std::filesystem::path& path() const { return directory_.path(); }

 private:
  test::TemporaryDirectory directory_;
};

/// χ² of the events' times modulo the frame period relative to a uniform histogram of 20 bins. Because neighbouring
/// events are correlated, only every `stride`-th event is counted, about 4000 per test.
double banding(const std::vector<Event>& events) {
  constexpr std::size_t kBins = 20, kCounted = 4000;
  const std::size_t stride = std::max<std::size_t>(1, events.size() / kCounted);
  std::vector<double> bins(kBins);
  double count = 0;
  for (std::size_t i = 0; i < events.size(); i += stride) {
    if (events[i].t <= 2 * kPeriod) continue;  // until the references have spread over all levels
    ++bins[static_cast<std::size_t>((events[i].t - 1) % kPeriod * static_cast<TimeNs>(kBins) / kPeriod)];
    ++count;
  }
  EXPECT_GT(count, 3000);
  double chi2 = 0;
  for (const double bin : bins) chi2 += std::pow(bin - count / kBins, 2) / (count / kBins);
  return chi2;
}

TEST_F(ConvertTest, EventsOfAMovingPatternShowNoFrames) {
  write_frames(24, 2.7);
  Memory followed, blended;
  convert_folder(path(), followed, {.threads = 2});
  convert_folder(path(), blended, {.interpolation = {.interpolation = false}, .threads = 2});
  // With 19 degrees of freedom, one in a thousand uniform histograms exceeds 43.8.
  EXPECT_LT(banding(followed.events), 43.8);
  EXPECT_GT(banding(blended.events), 200) << "the test is not sensitive enough";
}

TEST_F(ConvertTest, AStillSceneFiresNothingAndABrightnessRampOnTime) {
  write_frames(3, 0);
  Memory still;
  EXPECT_EQ(convert_folder(path(), still).steps, 2);
  EXPECT_TRUE(still.events.empty());

  write_frames(2, 0, 0.5);
  std::filesystem::remove(path() / "2.png");
  Memory ramp;
  convert_folder(path(), ramp, {.interpolation = {.interpolation = false}});
  // Each pixel fires when the line between its two values of brightness crosses multiples of the threshold.
  std::vector<int> fired(std::size_t{kWidth} * kHeight);
  for (const Event& event : ramp.events) {
    const double light = 0.25 * kPattern(event.x, event.y), log_eps = EventCameraOptions().log_eps;
    const double rise = std::log((light * std::exp(0.5) + log_eps) / (light + log_eps));
    const int nth = ++fired[std::size_t{event.y} * kWidth + event.x];
    EXPECT_EQ(event.polarity, 1);
    EXPECT_NEAR(static_cast<double>(event.t), 0.2 * nth / rise * static_cast<double>(kPeriod), 0.01 * kPeriod);
  }
  EXPECT_EQ(std::count(fired.begin(), fired.end(), 2), std::ptrdiff_t{kWidth} * kHeight);
}

TEST_F(ConvertTest, WritesImagesAndEventsInOrderOfTimeToTheEnd) {
  write_frames(4, 3);
  Memory out;
  const ConversionSummary summary = convert_folder(path(), out);
  EXPECT_TRUE(summary.complete);
  EXPECT_EQ(out.complete, true);
  EXPECT_EQ(out.image_times, (std::vector<TimeNs>{0, kPeriod, 2 * kPeriod, 3 * kPeriod}));
  EXPECT_EQ(out.info->end, 3 * kPeriod);
  EXPECT_DOUBLE_EQ(out.info->truth_rate_hz, 25);
  EXPECT_EQ(summary.events_on + summary.events_off, static_cast<std::int64_t>(out.events.size()));
  EXPECT_TRUE(std::is_sorted(out.events.begin(), out.events.end()));
  EXPECT_GT(out.events.back().t, 3 * kPeriod - kPeriod / 4) << "to the very end";
  EXPECT_EQ(summary.frames, 4);
  EXPECT_GE(summary.steps, 3 * 6);
}

TEST_F(ConvertTest, TheSameEventsOnAnyNumberOfThreads) {
  write_frames(4, 3);
  std::vector<std::vector<Event>> results;
  for (const int threads : {1, 2, 5}) {
    Memory out;
    convert_folder(path(), out, {.colour = true, .threads = threads});
    results.push_back(out.events);
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST_F(ConvertTest, CountsThePixelsThatTheFlowDoesNotFollow) {
  const auto summary_of = [&](double speed, const Settings& settings = {}) {
    write_frames(4, speed);
    Memory out;
    return convert_folder(path(), out, settings);
  };
  const ConversionSummary slow = summary_of(3), fast = summary_of(60);  // of 96 px
  EXPECT_LT(*not_followed_fraction(slow), 0.15);
  EXPECT_EQ(slow.mostly_not_followed, 0);
  EXPECT_GT(*not_followed_fraction(fast), 0.5);
  EXPECT_EQ(fast.mostly_not_followed, 3);
  EXPECT_FALSE(not_followed_fraction(summary_of(3, {.interpolation = {.interpolation = false}})));
  EXPECT_FALSE(not_followed_fraction(summary_of(0))) << "nothing changes";
}

TEST_F(ConvertTest, ABadFrameKeepsWhatCameBefore) {
  write_frames(5, 3);
  Memory whole, cut;
  convert_folder(path(), whole);
  test::write_png(path() / "3.png", kWidth, kHeight - 1, 0);
  const ConversionSummary summary = convert_folder(path(), cut);
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(cut.complete, false);
  EXPECT_TRUE(test::contains(summary.problem, "frame 3 (3.png)"));
  EXPECT_EQ(summary.frames, 3);
  EXPECT_EQ(summary.end, 2 * kPeriod);
  std::erase_if(whole.events, [](const Event& event) { return event.t > 2 * kPeriod; });
  EXPECT_EQ(cut.events, whole.events);
}

TEST_F(ConvertTest, FewerThanTwoFramesWriteNothing) {
  const auto message = [&](Memory& out) { return test::message_of<UserError>([&] { convert_folder(path(), out); }); };
  Memory none, one, bad;
  EXPECT_TRUE(test::contains(message(none), "holds no images"));
  write_frames(1, 0);
  EXPECT_TRUE(test::contains(message(one), "has only one frame; events need at least two"));
  std::ofstream(path() / "1.png") << "broken";
  EXPECT_TRUE(test::contains(message(bad), "frame 1"));
  for (const Memory* memory : {&none, &one, &bad}) EXPECT_FALSE(memory->info.has_value());
}

TEST_F(ConvertTest, TheMonitorEndsIt) {
  write_frames(4, 3);
  Memory out;
  const ConversionSummary summary =
      convert_folder(path(), out, {.monitor = [](const Progress& progress) { return progress.samples < 10; }});
  EXPECT_FALSE(summary.complete);
  EXPECT_TRUE(summary.problem.empty());
  EXPECT_EQ(summary.steps, 10);
}

TEST(Bayer, RedAtEvenColumnsAndRows) {
  const Image<float> red(5, 4, 1), green(5, 4, 2), blue(5, 4, 3);
  Image<float> out;
  mosaic(red, green, blue, out);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) {
      EXPECT_EQ(out(x, y), x % 2 != y % 2 ? 2 : x % 2 == 0 ? 1 : 3) << x << " " << y;
    }
  }
}

TEST_F(ConvertTest, BayerPixelsSeeTheirColour) {
  // From black to red: only red pixels fire.
  test::write_png(path() / "0.png", kWidth, kHeight, 0);
  cv::imwrite((path() / "1.png").string(), cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(0, 0, 255)));
  Memory out;
  convert_folder(path(), out, {.colour = true});
  ASSERT_GE(out.events.size(), std::size_t{kWidth / 2 * kHeight / 2});
  for (const Event& event : out.events) ASSERT_TRUE(event.x % 2 == 0 && event.y % 2 == 0 && event.polarity == 1);
}

}  // namespace
}  // namespace esim
