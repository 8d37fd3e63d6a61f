// Luminance of image files, with filters. Transparency: translucent_image_test.cpp.
#include "esim/scene/images/image_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "esim/core/error.h"
#include "esim/scene/planes.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

class LuminanceFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const cv::Mat& image) {
    const std::filesystem::path file = folder_.path() / name;
    cv::imwrite(file.string(), image);
    return file;
  }
  std::string error(const std::filesystem::path& file, const Softening& softening) {
    return test::message_of<UserError>([&] { load_luminance(file, softening); });
  }

  test::TemporaryDirectory folder_;
};

TEST_F(LuminanceFile, LosesDotsToAMedian) {
  cv::Mat image(12, 16, CV_8UC3, cv::Scalar::all(102));
  image.at<cv::Vec3b>(5, 7) = {255, 255, 255};
  image.at<cv::Vec3b>(11, 0) = {0, 0, 0};
  const auto file = write("dots.png", image);
  EXPECT_NEAR(load_luminance(file)(7, 5), 1.0, 1e-6);
  const Image<float> clean = load_luminance(file, {.median_px = 5});
  for (const float light : clean.pixels()) EXPECT_NEAR(light, linear_from_srgb(0.4F), 1e-6);
}

TEST_F(LuminanceFile, IsBlurredAsLight) {
  cv::Mat image(32, 32, CV_8U, cv::Scalar(0));
  image.colRange(16, 32).setTo(255);
  const Image<float> soft = load_luminance(write("edge.png", image), {.gaussian_px = 2});
  EXPECT_NEAR(soft(17, 9), 0.5 * std::erfc(-1.5 / 2 / std::sqrt(2.0)), 0.005);
  EXPECT_NEAR(soft(15, 9) + soft(16, 9), 1.0, 1e-5);
  EXPECT_EQ(soft(0, 9), 0.0F);
}

TEST_F(LuminanceFile, IsFilteredAcrossTheEdgesWhereItGoesAround) {
  cv::Mat image(32, 64, CV_8U, cv::Scalar(0));
  image.colRange(0, 32).setTo(255);  // edges in the middle and at the border of the image
  const auto file = write("around.png", image);
  for (const Softening& softening : {Softening{0, 2, true}, Softening{0, 20, true}}) {
    const Image<float> soft = load_luminance(file, softening);
    for (int k = 0; k < 16; ++k) EXPECT_NEAR(soft(k, 9), soft(31 - k, 9), 1e-5);
    EXPECT_NEAR(soft(0, 9) + soft(63, 9), 1.0, 1e-5);
  }
  cv::Mat line(8, 8, CV_8U, cv::Scalar(0));
  line.colRange(0, 2).setTo(255);
  line.col(7).setTo(255);
  const Image<float> thick = load_luminance(write("line.png", line), {5, 0, true});
  EXPECT_EQ(thick(0, 4), 1.0F) << "three of five columns";
  EXPECT_EQ(thick(7, 4), 1.0F);
  EXPECT_EQ(thick(2, 4), 0.0F);
}

TEST_F(LuminanceFile, HasNoMedianWhereItIsNotOfBytes) {
  EXPECT_TRUE(
      test::contains(error(write("words.png", cv::Mat(4, 4, CV_16U, cv::Scalar(7))), {.median_px = 3}), "8 bits"));
  EXPECT_TRUE(test::contains(error(write("light.hdr", cv::Mat(9, 9, CV_32FC3, cv::Scalar::all(7))), {.median_px = 3}),
                             "8 bits"));
  EXPECT_TRUE(test::contains(error(folder_.write("light.exr", ""), {.median_px = 3}), "8 bits"));
  EXPECT_TRUE(test::contains(error(write("a.png", cv::Mat(4, 4, CV_8U, cv::Scalar(7))), {.median_px = 4}), "odd"));
  EXPECT_TRUE(test::contains(error(folder_.path() / "none.png", {.median_px = 3}), "no such file"));
  EXPECT_NEAR(load_luminance(folder_.path() / "light.hdr", {.gaussian_px = 1})(4, 4), 7, 0.05);
}

}  // namespace
}  // namespace esim
