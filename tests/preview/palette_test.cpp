#include "esim/preview/palette.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/videoio.hpp>

#include "esim/preview/video_file.h"

namespace esim {
namespace {

int distance(Rgb a, Rgb b) { return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)}); }

TEST(Palette, FewColoursStayAsTheyAre) {
  Image<Rgb> image(16, 16);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x)
      image(x, y) = {static_cast<std::uint8_t>(16 * x + 3), static_cast<std::uint8_t>(16 * y + 5), 77};
  }
  const PaletteImage reduced = reduce_colours(image);
  for (std::size_t i = 0; i < image.size(); ++i)
    EXPECT_EQ(reduced.colours[reduced.indices.pixels()[i]], image.pixels()[i]);
}

TEST(Palette, ManyColoursStayNear) {
  Image<Rgb> image(256, 256);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x)
      image(x, y) = {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                     static_cast<std::uint8_t>((x + y) / 2)};
  }
  const PaletteImage reduced = reduce_colours(image);
  for (std::size_t i = 0; i < image.size(); ++i)
    EXPECT_LE(distance(reduced.colours[reduced.indices.pixels()[i]], image.pixels()[i]), 24);
  EXPECT_TRUE(reduce_colours({}).indices.empty());
}

TEST(VideoFile, GifsAreReadAgain) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "esim_video_file_test.gif";
  const std::array<Rgb, 3> colours = {Rgb{255, 152, 20}, {40, 140, 255}, {13, 15, 20}};
  VideoFile video(path, 32, 16, 20, VideoKind::gif);
  for (const Rgb colour : colours) video.append(Image<Rgb>(32, 16, colour));
  video.close();
  cv::VideoCapture capture(path.string());
  cv::Mat frame;
  for (const Rgb colour : colours) {
    ASSERT_TRUE(capture.read(frame));
    const auto bgr = frame.at<cv::Vec3b>(8, 16);
    EXPECT_LE(distance({bgr[2], bgr[1], bgr[0]}, colour), 3);
  }
  EXPECT_FALSE(capture.read(frame));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace esim
