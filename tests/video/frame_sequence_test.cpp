#include "esim/video/frame_sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "esim/core/error.h"
#include "esim/video/stamps_file.h"
#include "support/errors.h"
#include "support/temporary_directory.h"
#include "video/videos.h"

namespace esim {
namespace {

constexpr int kWidth = 24, kHeight = 18;

double srgb(double code) { return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4); }

struct Taken {
  std::vector<double> times_ms;
  std::vector<float> values;  // of pixel (3, 2)
};

Taken take_all(FrameSequence& frames) {
  Taken taken;
  for (Frame frame; frames.next(frame);) {
    taken.times_ms.push_back(static_cast<double>(frame.t) / kNsPerMs);
    taken.values.push_back(frame.planes[0](3, 2));
  }
  return taken;
}

Taken take_all(const std::filesystem::path& input, const VideoOptions& options = {}) {
  FrameSequence frames(input, options, false);
  return take_all(frames);
}

std::string refusal(const std::filesystem::path& input, const VideoOptions& options = {}) {
  return test::message_of<UserError>([&] { take_all(input, options); });
}

class FrameSequenceTest : public testing::Test {
 protected:
  /// A folder of three images with values 50, 60, 70, whose order differs from that of their names as text.
  std::filesystem::path images(const std::string& name = "images") const {
    const auto folder = directory_.path() / name;
    std::filesystem::create_directory(folder);
    int code = 50;
    for (const char* file : {"f9.png", "f10.png", "f011.png"}) {
      test::write_png(folder / file, kWidth, kHeight, code);
      code += 10;
    }
    return folder;
  }
  void write(const std::filesystem::path& path, const std::string& text) const { std::ofstream(path) << text; }

  test::TemporaryDirectory directory_;
};

TEST_F(FrameSequenceTest, VideoStampsAndCodesAreExact) {
  const auto path = directory_.path() / "grey.mkv";
  const std::vector<std::int64_t> stamps = {20, 60, 61, 200};
  test::write_video(path, AV_PIX_FMT_GRAY8, kWidth, kHeight, stamps, [](int, int, int i) { return 20 + 70 * i; });
  FrameSequence frames(path, {}, false);
  EXPECT_EQ(frames.width(), kWidth);
  EXPECT_EQ(frames.height(), kHeight);
  EXPECT_EQ(frames.frames(), 4);
  EXPECT_EQ(frames.start(), 20 * kNsPerMs);
  EXPECT_EQ(frames.end(), 200 * kNsPerMs);
  const Taken taken = take_all(frames);
  EXPECT_EQ(taken.times_ms, (std::vector<double>{20, 60, 61, 200}));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(taken.values[i], srgb((20.0 + 70.0 * double(i)) / 255), 1e-6);
}

TEST_F(FrameSequenceTest, DeepVideoKeepsItsBits) {
  const auto grey16 = directory_.path() / "grey16.mkv";
  test::write_video(grey16, AV_PIX_FMT_GRAY16LE, kWidth, kHeight, {0, 40}, [](int, int, int i) { return 300 + i; });
  const Taken taken = take_all(grey16, {.encoding = Encoding::linear});
  EXPECT_NEAR(taken.values[0], 300.0 / 65535, 1e-7);
  EXPECT_NEAR(taken.values[1], 301.0 / 65535, 1e-7);

  const auto grey10 = directory_.path() / "grey10.mkv";
  test::write_video(grey10, AV_PIX_FMT_GRAY10LE, kWidth, kHeight, {0, 40}, [](int, int, int i) { return 500 + i; });
  const Taken deep = take_all(grey10, {.encoding = Encoding::linear});
  EXPECT_NEAR(deep.values[0], 500.0 / 1023, 1e-3);
  EXPECT_NEAR(deep.values[1] - deep.values[0], 1.0 / 1023, 1e-4);
}

TEST_F(FrameSequenceTest, TimesCanBeReplacedStretchedAndCut) {
  const auto path = directory_.path() / "v.mkv";
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 11; ++i) stamps.push_back(100 + 10 * i);
  test::write_video(path, AV_PIX_FMT_GRAY8, kWidth, kHeight, stamps, [](int, int, int i) { return 10 * i; });
  EXPECT_EQ(take_all(path, {.fps = 1000}).times_ms[7], 7);
  EXPECT_EQ(take_all(path, {.slow_motion = 4}).times_ms[10], 100 + 25);
  const Taken part = take_all(path, {.start = 0.025, .duration = 0.04});
  EXPECT_EQ(part.times_ms, (std::vector<double>{130, 140, 150, 160}));
  EXPECT_NEAR(part.values[0], srgb(30.0 / 255), 1e-6);
  EXPECT_TRUE(test::contains(refusal(path, {.start = 1}), "the start, 1 s, is beyond"));
}

TEST_F(FrameSequenceTest, ImagesInNaturalOrder) {
  const auto folder = images();
  EXPECT_TRUE(test::contains(refusal(folder), "(fps)"));
  const Taken taken = take_all(folder, {.fps = 50});
  EXPECT_EQ(taken.times_ms, (std::vector<double>{0, 20, 40}));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(taken.values[i], srgb((50.0 + 10.0 * double(i)) / 255), 1e-6);
}

TEST_F(FrameSequenceTest, EveryKindOfStampsFile) {
  const auto folder = images();
  const std::vector<double> expected = {500, 600, 750};
  for (const char* text :
       {"0.5\n0.6\n0.75\n", "# s\n5e-1\n6.0e-1\n7.5e-1", "0.5 f9.png\n0.6 f10.png\n\n0.75 f011.png\n",
        "# index t_s file\n0 0.5 f9.png\n1 0.6 f10.png\r\n2 0.75 f011.png\n"}) {
    write(folder / "timestamps.txt", text);
    EXPECT_EQ(take_all(folder).times_ms, expected) << text;
  }
  write(folder / "images.csv", "timestamp, path\n1500000000500000001, f10.png\n1500000000600000002,f9.png\n");
  FrameSequence frames(folder, {}, false);
  EXPECT_EQ(frames.start(), 1500000000500000001);
  EXPECT_EQ(frames.end(), 1500000000600000002);
  EXPECT_NEAR(take_all(frames).values[0], srgb(60.0 / 255), 1e-6);
}

TEST_F(FrameSequenceTest, SecondsAreExact) {
  EXPECT_EQ(parse_seconds("1500000000.123456789"), 1500000000123456789);
  EXPECT_EQ(parse_seconds("-0.5"), -500'000'000);
  EXPECT_EQ(parse_seconds(".25"), 250'000'000);
  EXPECT_EQ(parse_seconds("1.25e-1"), 125'000'000);
  for (const char* bad : {"", "x", "1.2.3", "nan", "1e30", "--1", "1 2"}) EXPECT_FALSE(parse_seconds(bad)) << bad;
}

TEST_F(FrameSequenceTest, DeepAndFloatingPointImages) {
  const auto folder = directory_.path() / "deep";
  std::filesystem::create_directory(folder);
  test::write_png(folder / "1.png", kWidth, kHeight, 1000, CV_16UC1);
  test::write_exr(folder / "2.exr", kWidth, kHeight, [](int, int) { return 3.5F; });
  const Taken automatic = take_all(folder, {.fps = 1});
  EXPECT_NEAR(automatic.values[0], srgb(1000.0 / 65535), 1e-7);
  EXPECT_EQ(automatic.values[1], 3.5F);
  EXPECT_NEAR(take_all(folder, {.encoding = Encoding::linear, .fps = 1}).values[0], 1000.0 / 65535, 1e-7);
}

TEST_F(FrameSequenceTest, ColourHasThreePlanesAndTheirLuminance) {
  const auto folder = directory_.path() / "colour";
  std::filesystem::create_directory(folder);
  cv::imwrite((folder / "1.png").string(), cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(30, 120, 220)));  // B, G, R
  Frame frame;
  FrameSequence(folder, {.fps = 1}, true).next(frame);
  ASSERT_EQ(frame.planes.size(), 3u);
  const double red = srgb(220.0 / 255), green = srgb(120.0 / 255), blue = srgb(30.0 / 255);
  EXPECT_NEAR(frame.planes[0](3, 2), red, 1e-6);
  EXPECT_NEAR(frame.planes[2](3, 2), blue, 1e-6);
  EXPECT_NEAR(take_all(folder, {.fps = 1}).values[0], 0.2126 * red + 0.7152 * green + 0.0722 * blue, 1e-6);
}

TEST_F(FrameSequenceTest, RefusesWhatIsNoVideo) {
  EXPECT_TRUE(test::contains(refusal(directory_.path() / "none.mp4"), "none.mp4: no such file"));
  EXPECT_TRUE(test::contains(refusal(directory_.write("text.mp4", "hello")), "text.mp4"));
  const auto empty = directory_.path() / "empty";
  std::filesystem::create_directory(empty);
  EXPECT_TRUE(test::contains(refusal(empty), "holds no images"));
}

TEST_F(FrameSequenceTest, RefusesBadStamps) {
  const auto folder = images();
  const struct {
    const char *file, *text, *message;
  } cases[] = {
      {"timestamps.txt", "0.5\n0.6\n", "3 images but 2 time stamps"},
      {"timestamps.txt", "0.5\n0.6\n0.6\n", "frame 2: its time, 0.600000000 s, is not after"},
      {"timestamps.txt", "0.5\n0.6 f9.png\n0.7\n", "timestamps.txt, line 2: expected"},
      {"timestamps.txt", "a\nb\n0.6\n", "timestamps.txt, line 2: expected"},
      {"images.csv", "10, f9.png\n5, f10.png\n", "frame 1: its time"},
      {"images.csv", "10, f9.png\n15.5, f10.png\n", "images.csv, line 2: expected"},
      {"images.csv", "10, f9.png\n20, gone.png\n", "images.csv: frame 1, gone.png, is missing"},
      {"images.csv", "# nothing", "names no frames"},
  };
  for (const auto& [file, text, message] : cases) {
    write(folder / file, text);
    EXPECT_TRUE(test::contains(refusal(folder), message)) << text;
  }
  write(folder / "images.csv", "10, f9.png\n5, f10.png\n");
  EXPECT_EQ(take_all(folder, {.fps = 10}).times_ms.size(), 2u) << "--fps repairs them";
}

TEST_F(FrameSequenceTest, NamesTheFrameThatCannotBeUsed) {
  const auto folder = images();
  const auto bad = folder / "f11.png";
  test::write_png(bad, kWidth + 1, kHeight, 1);
  EXPECT_TRUE(
      test::contains(refusal(folder, {.fps = 10}), "frame 3 (f11.png): is 25 x 18 px, but the first one 24 x 18"));
  write(bad, "\x89PNG\r\n\x1a\nbroken");
  EXPECT_TRUE(test::contains(refusal(folder, {.fps = 10}), "frame 3: image " + bad.string() + ": cannot be decoded"));
  std::filesystem::remove(bad);
  const auto cut = folder / "f13.jpg";
  cv::imwrite(cut.string(), cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(9)));
  EXPECT_EQ(take_all(folder, {.fps = 10}).values.size(), 4u);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) - 10);
  EXPECT_TRUE(test::contains(refusal(folder, {.fps = 10}),
                             "frame 3: image " + cut.string() + ": is not a JPEG image, or is cut"));
  std::filesystem::remove(cut);
  for (const float value : {-0.5F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    test::write_exr(folder / "f12.exr", kWidth, kHeight, [&](int x, int y) { return x == 7 && y == 5 ? value : 0.5F; });
    EXPECT_TRUE(test::contains(refusal(folder, {.fps = 10}), "frame 3 (f12.exr): pixel (7, 5) is ")) << value;
  }
}

TEST_F(FrameSequenceTest, ACutVideoGivesItsFramesAndThenAnError) {
  const auto path = directory_.path() / "v.mkv";
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 100; ++i) stamps.push_back(40 * i);
  std::mt19937 random(1);
  test::write_video(path, AV_PIX_FMT_GRAY8, kWidth, kHeight, stamps,
                    [&](int, int, int) { return static_cast<int>(random() % 256); });
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  FrameSequence frames(path, {}, false);
  int taken = 0;
  const std::string message = test::message_of<UserError>([&] {
    for (Frame frame; frames.next(frame);) ++taken;
  });
  EXPECT_GT(taken, 40);
  EXPECT_LT(taken, 55);
  EXPECT_TRUE(test::contains(message, "frame " + std::to_string(taken)));
}

}  // namespace
}  // namespace esim
