// Image files, compared with OpenCV's decoders and encoders; kinds that OpenCV does not write are written with libpng.
#include "esim/files/codecs/image_codecs.h"

#include <gtest/gtest.h>
#include <png.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

namespace esim {
namespace {

using Bytes = std::vector<unsigned char>;

bool decode(const Bytes& file, ImagePixels& pixels) { return decode_image(std::as_bytes(std::span(file)), pixels); }

/// The pixels as OpenCV stores them: blue first.
cv::Mat blue_first(const ImagePixels& pixels) {
  const int depth = pixels.bits == 8 ? CV_8U : pixels.bits == 16 ? CV_16U : CV_32F;
  cv::Mat image(pixels.height, pixels.width, CV_MAKETYPE(depth, pixels.channels));
  for (int y = 0; y < pixels.height; ++y) std::copy_n(pixels.row(y), pixels.row_bytes, image.ptr(y));
  if (pixels.channels == 3) cv::cvtColor(image, image, cv::COLOR_RGB2BGR);
  if (pixels.channels == 4) cv::cvtColor(image, image, cv::COLOR_RGBA2BGRA);
  return image;
}

bool are_equal(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0;
}

/// Soft structures and noise.
cv::Mat picture(int type) {
  cv::Mat image(37, 53, CV_MAKETYPE(CV_32F, CV_MAT_CN(type)));
  std::mt19937 random(7);
  for (int y = 0; y < image.rows; ++y) {
    auto* number = image.ptr<float>(y);
    for (int i = 0; i < image.cols * image.channels(); ++i)
      number[i] =
          0.5F + 0.4F * std::sin(0.1F * static_cast<float>(i + 5 * y)) + 1e-4F * static_cast<float>(random() % 900);
  }
  const double full = CV_MAT_DEPTH(type) == CV_8U ? 255 : CV_MAT_DEPTH(type) == CV_16U ? 65535 : 3;
  image.convertTo(image, type, full);
  return image;
}

struct Kind {
  const char* extension;
  int type;
  std::vector<int> options{};
};

std::vector<Kind> kinds() {
  return {{".png", CV_8UC1},
          {".png", CV_8UC3},
          {".png", CV_8UC4},
          {".png", CV_16UC1},
          {".png", CV_16UC3},
          {".png", CV_16UC4},
          {".png", CV_8UC1, {cv::IMWRITE_PNG_BILEVEL, 1}},
          {".jpg", CV_8UC1},
          {".jpg", CV_8UC3},
          {".jpg", CV_8UC3, {cv::IMWRITE_JPEG_PROGRESSIVE, 1}},
          {".webp", CV_8UC3, {cv::IMWRITE_WEBP_QUALITY, 60}},
          {".webp", CV_8UC4, {cv::IMWRITE_WEBP_QUALITY, 101}},
          {".hdr", CV_32FC3},
          {".pgm", CV_8UC1},
          {".ppm", CV_8UC3},
          {".pgm", CV_16UC1},
          {".ppm", CV_16UC3},
          {".pgm", CV_8UC1, {cv::IMWRITE_PXM_BINARY, 0}},
          {".ppm", CV_8UC3, {cv::IMWRITE_PXM_BINARY, 0}}};
}

Bytes encoded(const Kind& kind) {
  Bytes file;
  cv::imencode(kind.extension, picture(kind.type), file, kind.options);
  return file;
}

TEST(ImageCodecs, DecodeAsOpenCV) {
  ImagePixels pixels;  // reused for all images
  for (const Kind& kind : kinds()) {
    const Bytes file = encoded(kind);
    ASSERT_TRUE(decode(file, pixels)) << kind.extension << ' ' << kind.type;
    EXPECT_TRUE(are_equal(blue_first(pixels), cv::imdecode(file, cv::IMREAD_UNCHANGED)))
        << kind.extension << ' ' << kind.type;
  }
}

TEST(ImageCodecs, EncodeAsOpenCV) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3}) {
    const cv::Mat image = picture(type);
    cv::Mat swapped = image.clone();
    if (image.channels() == 3) cv::cvtColor(image, swapped, cv::COLOR_BGR2RGB);
    const PixelView view{.data = swapped.data,
                         .row_bytes = swapped.step[0],
                         .width = swapped.cols,
                         .height = swapped.rows,
                         .channels = swapped.channels(),
                         .bits = swapped.depth() == CV_8U ? 8 : 16};
    Bytes fast, small, jpeg;
    cv::imencode(".png", image, fast);
    cv::imencode(".png", image, small, {cv::IMWRITE_PNG_COMPRESSION, 3});
    EXPECT_TRUE(encode_png(view, PngEffort::fast) == std::string(fast.begin(), fast.end()))
        << type << ": " << encode_png(view, PngEffort::fast).size() << ' ' << fast.size();
    EXPECT_TRUE(encode_png(view, PngEffort::small) == std::string(small.begin(), small.end()))
        << type << ": " << encode_png(view, PngEffort::small).size() << ' ' << small.size();
    if (view.bits == 16) continue;
    cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
    const std::string ours = encode_jpeg(view, 90);
    EXPECT_TRUE(are_equal(cv::imdecode(Bytes(ours.begin(), ours.end()), cv::IMREAD_UNCHANGED),
                          cv::imdecode(jpeg, cv::IMREAD_UNCHANGED)));
  }
}

TEST(ImageCodecs, ReduceJpegs) {
  Bytes file;
  cv::imencode(".jpg", picture(CV_8UC3), file);
  ImagePixels pixels;
  for (const int factor : {2, 4, 8}) {
    ASSERT_TRUE(decode_reduced_jpeg(std::as_bytes(std::span(file)), factor, pixels));
    EXPECT_EQ(pixels.width, (53 + factor - 1) / factor);
    EXPECT_EQ(pixels.height, (37 + factor - 1) / factor);
    EXPECT_EQ(pixels.channels, 3);
  }
}

void append(png_structp png, png_bytep from, std::size_t count) {
  auto& file = *static_cast<Bytes*>(png_get_io_ptr(png));
  file.insert(file.end(), from, from + count);
}

struct PngKind {
  int type, bits;
  bool interlaced = false, transparent = false;
};

/// An image of 5 x 3 px, whose bytes are 0, 1, 2, ... in each row.
Bytes png_of(const PngKind& kind) {
  Bytes file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &file, append, nullptr);
  png_set_IHDR(png, info, 5, 3, kind.bits, kind.type, kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  std::vector<png_color> palette;
  for (int i = 0; i < std::min(64, 1 << kind.bits); ++i)
    palette.push_back({static_cast<png_byte>(3 * i), static_cast<png_byte>(200 - i), static_cast<png_byte>(i)});
  if (kind.type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  const png_byte alpha[] = {10, 20, 30};
  if (kind.transparent) png_set_tRNS(png, info, alpha, 3, nullptr);
  png_write_info(png, info);
  std::vector<Bytes> rows(3, Bytes(png_get_rowbytes(png, info)));
  std::vector<png_bytep> starts;
  for (Bytes& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = static_cast<unsigned char>(i);
    starts.push_back(row.data());
  }
  png_write_image(png, starts.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return file;
}

TEST(ImageCodecs, DecodeRarePngs) {
  ImagePixels pixels;
  for (const PngKind& kind : {PngKind{PNG_COLOR_TYPE_PALETTE, 8}, PngKind{PNG_COLOR_TYPE_PALETTE, 8, true, true},
                              PngKind{PNG_COLOR_TYPE_PALETTE, 4}, PngKind{PNG_COLOR_TYPE_GRAY, 2},
                              PngKind{PNG_COLOR_TYPE_GRAY, 16, true}, PngKind{PNG_COLOR_TYPE_RGB, 8, true},
                              PngKind{PNG_COLOR_TYPE_GRAY_ALPHA, 8}, PngKind{PNG_COLOR_TYPE_GRAY_ALPHA, 16}}) {
    const Bytes file = png_of(kind);
    ASSERT_TRUE(decode(file, pixels)) << kind.type << ' ' << kind.bits;
    EXPECT_TRUE(are_equal(blue_first(pixels), cv::imdecode(file, cv::IMREAD_UNCHANGED)))
        << kind.type << ' ' << kind.bits;
  }
}

TEST(ImageCodecs, ScalePortableMaps) {
  ImagePixels pixels;
  const auto decode_text = [&](std::string_view text) { return decode(Bytes(text.begin(), text.end()), pixels); };
  ASSERT_TRUE(decode_text("P2 # a comment\n3 1\n# another\n10\n0 5 10\n"));
  EXPECT_EQ(pixels.bytes, (Bytes{0, 127, 255}));
  ASSERT_TRUE(decode_text(std::string_view("P5 2 1 1023\n\x03\xff\x00\x00", 16)));
  EXPECT_EQ(pixels.bits, 16);
  EXPECT_EQ(pixels.bytes, (Bytes{255, 255, 0, 0}));
  for (const std::string_view bad : {"P2 3 1 10\n0 5", "P5 3 1 255\nab", "P5 3 1 0\nabc", "P5 3 1 70000\nabcdef",
                                     "P4 1 1\n1", "P", "P5 -3 1 255\nabc", "P2 99999 99999 255\n1", "P5 3 1 255"})
    EXPECT_FALSE(decode_text(bad)) << bad;
}

TEST(ImageCodecs, SurviveDamage) {
  ImagePixels pixels;
  std::mt19937 random(1);
  for (const Kind& kind : kinds()) {
    const Bytes file = encoded(kind);
    for (std::size_t size = 0; size < file.size(); size += 1 + size / 8) {
      const bool decoded = decode(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)), pixels);
      EXPECT_TRUE(!decoded || kind.extension == std::string(".jpg") || kind.extension[2] == 'p')
          << kind.extension << size;
    }
    for (int trial = 0; trial < 200; ++trial) {
      Bytes damaged = file;
      for (int i = 0; i < 3; ++i) damaged[random() % damaged.size()] = static_cast<unsigned char>(random());
      if (decode(damaged, pixels)) {
        EXPECT_EQ(pixels.bytes.size(), pixels.row_bytes * static_cast<std::size_t>(pixels.height));
      }
    }
  }
}

}  // namespace
}  // namespace esim
