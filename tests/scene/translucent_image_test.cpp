#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/imgcodecs.hpp>

#include "esim/core/error.h"
#include "esim/scene/images/image_file.h"
#include "esim/scene/planes.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

class TranslucentImageFile : public testing::Test {
 protected:
  std::filesystem::path write(const cv::Mat& image) {
    const std::filesystem::path file = folder_.path() / "image.png";
    cv::imwrite(file.string(), image);
    return file;
  }
  std::string error(const std::filesystem::path& file, const Softening& softening = {}) {
    const std::string message = test::message_of<UserError>([&] { load_translucent(file, softening); });
    EXPECT_TRUE(test::contains(message, file.filename().string()));
    return message;
  }

  /// A PNG file with a size in its header, but without pixels.
  std::filesystem::path claim(std::uint32_t width, std::uint32_t height) {
    std::string head = "\x89PNG\r\n\x1a\n";
    head += std::string("\0\0\0\rIHDR", 8);
    for (const std::uint32_t side : {width, height}) {
      for (const int shift : {24, 16, 8, 0}) head += static_cast<char>(side >> shift);
    }
    return folder_.write("claim.png", head + std::string("\x08\x06\0\0\0\0\0\0\0", 9));
  }

  test::TemporaryDirectory folder_;
};

TEST_F(TranslucentImageFile, MultipliesLinearLightByLinearAlpha) {
  const float grey = linear_from_srgb(0.4F);
  const TranslucentImage bytes = load_translucent(write(cv::Mat(3, 5, CV_8UC4, cv::Scalar(102, 102, 102, 51))));
  EXPECT_EQ(bytes.light.width(), 5);
  EXPECT_NEAR(bytes.alpha(2, 1), 0.2, 1e-6);
  EXPECT_NEAR(bytes.light(2, 1), 0.2F * grey, 1e-6);
  const TranslucentImage words =
      load_translucent(write(cv::Mat(3, 5, CV_16UC4, cv::Scalar(26214, 26214, 26214, 13107))));
  EXPECT_NEAR(words.alpha(4, 2), 0.2, 1e-6);
  EXPECT_NEAR(words.light(4, 2), 0.2F * grey, 1e-6);
}

TEST_F(TranslucentImageFile, HasNoAlphaWhereTheFileHasNone) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC3}) {
    const TranslucentImage image = load_translucent(write(cv::Mat(3, 5, type, cv::Scalar::all(99))));
    EXPECT_TRUE(image.alpha.empty());
    EXPECT_EQ(image.light(1, 1), load_luminance(folder_.path() / "image.png")(1, 1));
  }
}

TEST_F(TranslucentImageFile, BlursLightAndAlphaAlike) {
  // White with an edge in alpha; the transparent half is black in the file, and must not darken the edge.
  cv::Mat image(32, 32, CV_8UC4, cv::Scalar(255, 255, 255, 255));
  image.colRange(16, 32).setTo(cv::Scalar(0, 0, 0, 0));
  const TranslucentImage soft = load_translucent(write(image), {0, 2.0});
  EXPECT_NEAR(soft.alpha(15, 16) + soft.alpha(16, 16), 1.0, 1e-5);
  EXPECT_GT(soft.alpha(17, 16), 0.1F);
  for (int x = 0; x < 32; ++x) EXPECT_NEAR(soft.light(x, 16), soft.alpha(x, 16), 1e-5) << "white stays white";
}

TEST_F(TranslucentImageFile, TakesMediansOfEveryChannel) {
  cv::Mat image(9, 9, CV_8UC4, cv::Scalar(255, 255, 255, 255));
  image.at<cv::Vec4b>(4, 4) = {0, 0, 0, 0};
  EXPECT_EQ(load_translucent(write(image)).alpha(4, 4), 0.0F);
  EXPECT_EQ(load_translucent(write(image), {3, 0}).alpha(4, 4), 1.0F);
  EXPECT_EQ(load_translucent(write(image), {3, 0}).light(4, 4), 1.0F);
  EXPECT_TRUE(test::contains(error(write(image), {4, 0}), "odd"));
  EXPECT_TRUE(test::contains(error(write(cv::Mat(3, 3, CV_16UC4, cv::Scalar::all(7))), {3, 0}), "8 bits"));
}

TEST_F(TranslucentImageFile, RefusesWhatIsNoImage) {
  EXPECT_TRUE(test::contains(error(folder_.path() / "none.png"), "no such file"));
  EXPECT_TRUE(test::contains(error(folder_.write("empty.png", "")), "cannot be decoded"));
  EXPECT_TRUE(test::contains(error(folder_.write("text.png", "not a PNG")), "cannot be decoded"));
  EXPECT_TRUE(test::contains(error(claim(100'000, 100'000)), "100000x100000 pixels are not supported"));
  EXPECT_TRUE(test::contains(error(claim(20'000, 20'000)), "20000x20000 pixels are not supported"));
  EXPECT_TRUE(test::contains(error(claim(0, 7)), "0x7 pixels are not supported"));
  EXPECT_TRUE(test::contains(error(claim(10, 10)), "cannot be decoded"));
}

}  // namespace
}  // namespace esim
