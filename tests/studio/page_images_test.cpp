#include "esim/studio/scene_view/page_images.h"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "esim/core/error.h"

namespace esim::studio {
namespace {

std::vector<std::byte> encoded(const cv::Mat& image, const char* extension) {
  std::vector<unsigned char> bytes;
  cv::imencode(extension, image, bytes);
  std::vector<std::byte> result(bytes.size());
  std::memcpy(result.data(), bytes.data(), bytes.size());
  return result;
}

cv::Mat decoded_page(const std::string& bytes) {
  return cv::imdecode(std::vector<unsigned char>(bytes.begin(), bytes.end()), cv::IMREAD_UNCHANGED);
}

std::string as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Its left half blue, its right half red.
cv::Mat halves(int side) {
  cv::Mat image(side, side, CV_8UC3, cv::Scalar(0, 0, 200));
  image.colRange(0, side / 2).setTo(cv::Scalar(200, 0, 0));
  return image;
}

TEST(PageImages, WhatBrowsersShowAsItIsGoesAsItIs) {
  for (const char* const extension : {".jpg", ".png"}) {
    const CodedTexture texture{.name = "halves", .bytes = encoded(halves(300), extension), .opaque = true};
    const PageImage image = page_image(texture);
    EXPECT_EQ(image.type, std::strcmp(extension, ".jpg") == 0 ? "image/jpeg" : "image/png");
    EXPECT_EQ(image.bytes, as_text(texture.bytes));
  }
}

TEST(PageImages, WhatIsTurnedOrTransparentOrLargeOrOfAnotherKindIsMadeAnew) {
  std::vector<std::byte> turned = encoded(halves(64), ".jpg");
  // An Exif block that says "turn by half a turn", which esim does not.
  const std::string exif(
      "\xff\xe1\x00\x22"
      "Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x03\0\0\0\0\0\0\0",
      36);
  const auto* const begin = reinterpret_cast<const std::byte*>(exif.data());
  turned.insert(turned.begin() + 2, begin, begin + exif.size());
  cv::Mat glass(64, 64, CV_8UC4, cv::Scalar(0, 0, 200, 255));
  glass.colRange(0, 32).setTo(cv::Scalar(200, 0, 0, 255));
  for (const auto& bytes :
       {turned, encoded(glass, ".png"), encoded(halves(2100), ".png"), encoded(halves(64), ".webp")}) {
    const PageImage image = page_image({.name = "halves", .bytes = bytes, .opaque = true});
    EXPECT_EQ(image.type, "image/jpeg");
    EXPECT_NE(image.bytes, as_text(bytes));
    const cv::Mat shown = decoded_page(image.bytes);
    EXPECT_LE(std::max(shown.cols, shown.rows), 2048);
    ASSERT_EQ(shown.channels(), 3);
    EXPECT_NEAR(shown.at<cv::Vec3b>(10, shown.cols / 4)[0], 200, 4);
    EXPECT_NEAR(shown.at<cv::Vec3b>(10, 3 * shown.cols / 4)[2], 200, 4);
  }
}

TEST(PageImages, ThumbnailsAreSmall) {
  for (const char* const extension : {".jpg", ".png"}) {
    for (const int side : {2048, 512, 300}) {
      const Thumbnail small = thumbnail({.name = "halves", .bytes = encoded(halves(side), extension)}, 128);
      EXPECT_FALSE(small.whole);
      const cv::Mat shown = decoded_page(small.jpeg);
      EXPECT_GE(shown.cols, 128);
      EXPECT_LT(shown.cols, 300);
      EXPECT_NEAR(shown.at<cv::Vec3b>(shown.rows / 2, shown.cols / 4)[0], 200, 4);
      EXPECT_NEAR(shown.at<cv::Vec3b>(shown.rows / 2, 3 * shown.cols / 4)[2], 200, 4);
    }
  }
  EXPECT_TRUE(thumbnail({.name = "halves", .bytes = encoded(halves(100), ".jpg")}, 128).whole);
}

TEST(PageImages, WhatCannotBeDecodedIsSaid) {
  std::vector<std::byte> cut = encoded(halves(512), ".jpg");
  cut.resize(cut.size() / 2);
  const CodedTexture texture{.name = "broken.jpg", .bytes = cut, .opaque = true};
  EXPECT_THROW(page_image(texture), UserError);
  EXPECT_THROW(thumbnail(texture, 128), UserError);
  EXPECT_THROW(page_image({.name = "empty", .opaque = true}), UserError);
}

/// One half per colour and pixel, least significant byte first.
TEST(PageImages, LightKeepsValuesAboveWhite) {
  const auto half = [](const PageLight& light, std::size_t i) {
    return static_cast<unsigned char>(light.halves[2 * i]) | static_cast<unsigned char>(light.halves[2 * i + 1]) << 8;
  };
  Planes planes(3, Image<float>(4, 2));
  planes[0](1, 0) = 1, planes[1](1, 0) = 300, planes[2](1, 0) = 1e9F, planes[0](0, 1) = -1;
  const PageLight light = page_light(planes, 4);
  ASSERT_EQ(light.halves.size(), 2U * 3 * 8);
  EXPECT_EQ(half(light, 3), 0x3c00);
  EXPECT_EQ(half(light, 4), 0x5cb0);
  EXPECT_EQ(half(light, 5), 0x7bff);  // 65504
  EXPECT_EQ(half(light, 12), 0);

  Image<float> grey(8, 4);
  for (float& value : grey.pixels()) value = 2;
  const PageLight small = page_light({grey}, 4);
  EXPECT_EQ(small.width, 4);
  EXPECT_EQ(small.height, 2);
  ASSERT_EQ(small.halves.size(), 2U * 3 * 8);
  for (std::size_t i = 0; i < 3 * 8; ++i) EXPECT_EQ(half(small, i), 0x4000);
}

}  // namespace
}  // namespace esim::studio
