#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <tuple>

#include "esim/core/error.h"
#include "esim/plot/canvas.h"
#include "esim/preview/colours.h"
#include "esim/preview/panels.h"
#include "esim/preview/preview_writer.h"
#include "esim/preview/scales.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::TruthImages;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

int brightness(Rgb colour) { return colour.r + colour.g + colour.b; }

TEST(Colours, FlowWheel) {
  EXPECT_EQ(colour_motion(0, 0, 10), (Rgb{255, 255, 255}));
  // Opposite directions and the axes have different colours; on the rim no colour contains white.
  std::set<std::tuple<int, int, int>> seen;
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * 3.14159265358979 * i / 24;
    const Rgb c =
        colour_motion(static_cast<float>(10 * std::cos(angle)), static_cast<float>(10 * std::sin(angle)), 10.00001f);
    EXPECT_LE(std::min({c.r, c.g, c.b}), 1) << i;
    seen.insert({c.r, c.g, c.b});
  }
  EXPECT_EQ(seen.size(), 24u);
  // Motion to the right is red, as in the reference implementation; beyond full scale it is darker.
  const Rgb right = colour_motion(9.999f, 0, 10);
  EXPECT_GT(right.r, 250);
  EXPECT_LT(right.g + right.b, 60);
  EXPECT_LT(brightness(colour_motion(20, 0, 10)), brightness(right));
  EXPECT_EQ(colour_motion(kNaN, 0, 10), Rgb{});
  EXPECT_EQ(colour_motion(kInfinity, 0, 10), Rgb{});
}

TEST(Colours, Depth) {
  const Rgb near_colour = colour_depth(1, 1, 10), far_colour = colour_depth(10, 1, 10);
  EXPECT_GT(brightness(near_colour), brightness(far_colour));
  EXPECT_EQ(colour_depth(0.1f, 1, 10), near_colour);
  EXPECT_EQ(colour_depth(1e9f, 1, 10), far_colour);
  for (const float nothing : {kInfinity, kNaN, 0.0f, -1.0f, -kInfinity}) {
    EXPECT_EQ(colour_depth(nothing, 1, 10), kNoDepthColour);
  }
  for (int i = 0; i <= 100; ++i) {
    EXPECT_NE(colour_depth(static_cast<float>(std::pow(10, 0.01 * i)), 1, 10), kNoDepthColour);
  }
}

TEST(Colours, Events) {
  Image<float> on(4, 1), off(4, 1), irradiance(4, 1, 0.2f);
  on(1, 0) = 1;
  on(2, 0) = 30;
  off(3, 0) = 30;
  const auto image = render_events(on, off, irradiance);
  EXPECT_EQ(image(0, 0).r, image(0, 0).b);
  EXPECT_EQ(image(2, 0), kOnColour);
  EXPECT_EQ(image(3, 0), kOffColour);
  EXPECT_GT(image(1, 0).r, image(1, 0).b + 50);
  EXPECT_LT(image(1, 0).r, kOnColour.r);
}

TEST(Scales, OnlyGrow) {
  DepthScale depth;
  depth.include(Image<float>(10, 10, kInfinity));
  EXPECT_EQ(depth.near_m(), 0);
  depth.include(Image<float>(10, 10, 2.0f));
  EXPECT_LE(depth.near_m(), 2.0f);
  EXPECT_GE(depth.far_m(), 1.4f * depth.near_m());
  const float near_before = depth.near_m(), far_before = depth.far_m();
  depth.include(Image<float>(10, 10, 2.1f));
  EXPECT_EQ(depth.near_m(), near_before);
  EXPECT_EQ(depth.far_m(), far_before);
  depth.include(Image<float>(10, 10, 50.0f));
  EXPECT_EQ(depth.near_m(), near_before);
  EXPECT_GE(depth.far_m(), 50.0f);

  MotionScale flow;
  flow.include(Image<float>(10, 10, 3.0f), Image<float>(10, 10, 4.0f));
  EXPECT_EQ(flow.full_px_per_s(), 5.0f);
  flow.include(Image<float>(10, 10, 0.0f), Image<float>(10, 10, kNaN));
  EXPECT_EQ(flow.full_px_per_s(), 5.0f);
  flow.include(Image<float>(10, 10, 1e30f), Image<float>(10, 10, 0.0f));
  EXPECT_TRUE(std::isfinite(flow.full_px_per_s()));
}

TEST(PreviewLayoutTest, FitsAnyCamera) {
  for (const auto& [width, height] : {std::pair{240, 180},
                                      {128, 128},
                                      {346, 260},
                                      {640, 480},
                                      {1280, 720},
                                      {1920, 1080},
                                      {4000, 3000},
                                      {32, 20},
                                      {1, 1},
                                      {1000, 1},
                                      {1, 1000},
                                      {100, 1000}}) {
    const PreviewLayout layout(width, height);
    EXPECT_EQ(layout.width % 2, 0);
    EXPECT_EQ(layout.height % 2, 0);
    EXPECT_LE(layout.width, 1920);
    EXPECT_LE(layout.height, 1200);
    EXPECT_LE(layout.panel_x(2) + layout.panel_width, layout.width);
    if (width >= height && width > 10 && height > 1) {
      EXPECT_GE(layout.panel_width, 320) << width;
    }
    const TruthImages images(width, height, 0);
    const Image<float> none(width, height);
    const auto image = PreviewPage(layout).compose(
        {0, 0, none, none, images.irradiance, &images.depth, &images.motion_x, &images.motion_y, 1, 3, 100, "caption"});
    EXPECT_EQ(image.width(), layout.width);
    EXPECT_EQ(image.height(), layout.height);
  }
}

TEST(PreviewPageTest, KeepsNothingOfThePreviousFrame) {
  const PreviewLayout layout(64, 48);
  const TruthImages images(64, 48, 0);
  Image<float> none(64, 48), many(64, 48, 3);
  const auto frame = [&](TimeNs t, const Image<float>& on, float far_m, float full_flow) {
    return PreviewFrame{t, 0,     on,       none, images.irradiance, &images.depth, &images.motion_x, &images.motion_y,
                        1, far_m, full_flow};
  };
  PreviewPage page(layout);
  page.compose(frame(0, many, 3, 100));
  for (const auto& next : {frame(kNsPerMs, none, 3, 100), frame(2 * kNsPerMs, none, 4, 100), frame(0, many, 4, 200)}) {
    const Image<Rgb> drawn = page.compose(next), fresh = PreviewPage(layout).compose(next);
    EXPECT_TRUE(std::ranges::equal(drawn.pixels(), fresh.pixels()));
  }
}

TEST(PreviewLayoutTest, SmallCamerasGrowByWholeFactors) {
  EXPECT_EQ(PreviewLayout(240, 180).panel_width, 480);
  EXPECT_EQ(PreviewLayout(128, 128).panel_width, 384);
  EXPECT_EQ(PreviewLayout(100, 80).panel_height, 320);
  EXPECT_EQ(PreviewLayout(346, 260).panel_width, 346);
}

TEST(CanvasTest, DrawingOutsideIsCutOff) {
  Canvas canvas(20, 10, {255, 255, 255});
  canvas.text(-30, 5, "far outside", 12, {});
  canvas.text(15, 30, "below", 12, {});
  canvas.fill({-5, -5, 100, 7}, {1, 2, 3});
  canvas.draw(Image<Rgb>(50, 50, {9, 9, 9}), 15, 8);
  canvas.draw(Image<Rgb>(5, 5, {9, 9, 9}), -20, -20);
  EXPECT_EQ(canvas.pixels()(0, 0), (Rgb{1, 2, 3}));
  EXPECT_EQ(canvas.pixels()(19, 9), (Rgb{9, 9, 9}));
}

TEST(PlaybackTest, RealTimeUnlessTooShortOrTooFast) {
  EXPECT_EQ(choose_playback(10, 30).slowdown, 1);
  EXPECT_EQ(choose_playback(10, 30).frames_per_s, 30);
  EXPECT_EQ(choose_playback(1, 30).slowdown, 2);
  EXPECT_EQ(choose_playback(10, 1000).slowdown, 20);
  EXPECT_EQ(choose_playback(10, 1000).frames_per_s, 50);
  EXPECT_EQ(choose_playback(0.1, 1000).slowdown, 20);
  EXPECT_EQ(choose_playback(0.01, 100).slowdown, 20);
  EXPECT_EQ(choose_playback(1, 2).slowdown, 1);
  EXPECT_GT(choose_playback(1, 0).frames_per_s, 0);
  EXPECT_GT(choose_playback(-1, 30).frames_per_s, 0);
  EXPECT_GT(choose_playback(0, 1e9).frames_per_s, 0);
}

class PreviewWriterTest : public testing::Test {
 protected:
  void write_frames(PreviewWriter& writer, int frames) {
    writer.begin(test::recording_info(64, 48, 0, 2 * kNsPerSecond, 10));
    for (int i = 0; i < frames; ++i) {
      const auto events =
          test::random_events(static_cast<std::size_t>(100 * i), 64, 48, i * kNsPerMs, (i + 1) * kNsPerMs);
      writer.write(EventsRecord{0, events});
      writer.write(TruthImages(64, 48, 0.1 * i).at(i * 100 * kNsPerMs));
    }
  }
  test::TemporaryDirectory directory_;
};

TEST_F(PreviewWriterTest, VideoHasEveryFrameAndThePictureItsSize) {
  for (const bool complete : {true, false}) {
    PreviewWriter writer(directory_.path(), 0);
    write_frames(writer, 30);
    writer.end(complete);

    const PreviewLayout layout(64, 48);
    cv::VideoCapture video((directory_.path() / "preview.mp4").string(), cv::CAP_FFMPEG);
    ASSERT_TRUE(video.isOpened());
    EXPECT_EQ(video.get(cv::CAP_PROP_FPS), 10);
    int frames = 0;
    for (cv::Mat frame; video.read(frame); ++frames) {
      ASSERT_EQ(frame.cols, layout.width);
      ASSERT_EQ(frame.rows, layout.height);
    }
    EXPECT_EQ(frames, 30);
    const cv::Mat picture = cv::imread((directory_.path() / "preview.png").string());
    EXPECT_EQ(picture.cols, layout.width);
    EXPECT_EQ(picture.rows, layout.height);
    std::filesystem::remove(directory_.path() / "preview.png");
  }
}

TEST_F(PreviewWriterTest, OneFrameAndNone) {
  PreviewWriter one(directory_.path(), 0);
  write_frames(one, 1);
  one.end(true);
  const cv::Mat picture = cv::imread((directory_.path() / "preview.png").string());
  cv::VideoCapture video((directory_.path() / "preview.mp4").string(), cv::CAP_FFMPEG);
  cv::Mat frame;
  ASSERT_TRUE(video.read(frame));
  ASSERT_EQ(frame.size(), picture.size());
  EXPECT_LT(cv::norm(frame, picture, cv::NORM_L1) / static_cast<double>(3 * frame.total()), 2);  // levels
  std::filesystem::remove(directory_.path() / "preview.png");
  std::filesystem::remove(directory_.path() / "preview.mp4");
  PreviewWriter none(directory_.path(), 0);
  write_frames(none, 0);
  none.end(false);
  EXPECT_TRUE(std::filesystem::is_empty(directory_.path()));
}

TEST_F(PreviewWriterTest, FullDisk) {
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  for (const rlim_t limit : {rlim_t{0}, rlim_t{20'000}}) {
    const std::string message = test::message_of<OutputError>([&] {
      const test::FileSizeLimit full(limit);
      PreviewWriter writer(directory_.path(), 0);
      write_frames(writer, 40);
      writer.end(true);
    });
    EXPECT_TRUE(test::contains(message, "cannot write " + directory_.path().string()));
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(PreviewWriterTest, UnwritableFolder) {
  PreviewWriter writer("/nonexistent", 0);
  EXPECT_THROW(write_frames(writer, 1), OutputError);
}

}  // namespace
}  // namespace esim
