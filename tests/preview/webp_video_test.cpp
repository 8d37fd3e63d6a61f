#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string_view>

#include "esim/core/error.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/preview/video_file.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

std::uint32_t number(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

Image<Rgb> plain(Rgb colour) {
  Image<Rgb> image(64, 48);
  for (Rgb& pixel : image.pixels()) pixel = colour;
  return image;
}

/// One image of an animation as a file of its own.
std::string still(std::string_view chunk) {
  std::string file = "RIFF";
  for (int i = 0; i < 4; ++i) file += static_cast<char>((chunk.size() + 4) >> (8 * i));
  return file + "WEBP" + std::string(chunk);
}

TEST(WebPVideo, HoldsEachFrameForItsTime) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "video.webp";
  const std::vector<Rgb> colours = {{200, 30, 40}, {20, 190, 60}, {30, 40, 210}, {128, 128, 128}};
  VideoFile video(path, 64, 48, 30, VideoKind::webp);
  for (const Rgb colour : colours) video.append(plain(colour));
  video.close();

  std::ifstream stream(path, std::ios::binary);
  const std::string file{std::istreambuf_iterator<char>(stream), {}};
  ASSERT_EQ(file.substr(0, 4) + file.substr(8, 8), "RIFFWEBPVP8X");
  EXPECT_EQ(number(file, 4, 4) + 8, file.size());
  EXPECT_EQ(number(file, 24, 3) + 1, 64U);
  EXPECT_EQ(number(file, 27, 3) + 1, 48U);
  EXPECT_EQ(file.substr(30, 4), "ANIM");
  std::size_t at = 44, frame = 0, duration_ms = 0;
  for (; at < file.size(); ++frame) {
    ASSERT_EQ(file.substr(at, 4), "ANMF");
    ASSERT_LT(frame, colours.size());
    const std::size_t bytes = number(file, at + 4, 4);
    duration_ms += number(file, at + 20, 3);
    ImagePixels pixels;
    const std::string image = still(std::string_view(file).substr(at + 24, bytes - 16));
    ASSERT_TRUE(decode_image(std::as_bytes(std::span(image)), pixels));
    EXPECT_NEAR(pixels.row(20)[3 * 30], colours[frame].r, 3);
    EXPECT_NEAR(pixels.row(20)[3 * 30 + 1], colours[frame].g, 3);
    EXPECT_NEAR(pixels.row(20)[3 * 30 + 2], colours[frame].b, 3);
    at += 8 + bytes + bytes % 2;
  }
  EXPECT_EQ(at, file.size());
  EXPECT_EQ(frame, colours.size());
  EXPECT_EQ(duration_ms, 133U);
}

TEST(WebPVideo, RefusesWhatItCannotWrite) {
  const test::TemporaryDirectory folder;
  const auto refusal = [](const std::filesystem::path& path, int width) {
    return test::message_of<OutputError>([&] { VideoFile(path, width, 48, 30, VideoKind::webp); });
  };
  EXPECT_TRUE(test::contains(refusal(folder.path() / "missing" / "video.webp", 64), "No such file"));
  EXPECT_TRUE(test::contains(refusal(folder.path() / "video.webp", 16384), "16383 px"));
}

}  // namespace
}  // namespace esim
