#include "esim/dataset/generators/affine_sequences.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "esim/core/error.h"
#include "esim/dataset/generators/image_folder.h"
#include "esim/scene/images/dead_leaves.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

AffineOptions small() {
  AffineOptions options;
  options.width = 64, options.height = 48;
  options.duration_s = 0.02;
  options.flow_scale = 0.2;
  return options;
}

/// `image` at a place between its pixels; NaN outside.
double at(const Image<float>& image, double x, double y) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= image.width() || y0 + 1 >= image.height()) return NAN;
  const double fx = x - x0, fy = y - y0;
  return (1 - fy) * ((1 - fx) * image(x0, y0) + fx * image(x0 + 1, y0)) +
         fy * ((1 - fx) * image(x0, y0 + 1) + fx * image(x0 + 1, y0 + 1));
}

TEST(AffineSequences, OpticalFlowCarriesTheFirstImageToTheLast) {
  const AffineSequences sequences(small());
  for (const std::uint32_t index : {1U, 4U, 9U}) {
    const Sequence sequence = sequences.make(index);
    double with = 0, without = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double to_x = x + double{sequence.optical_flow.x(x, y)}, to_y = y + double{sequence.optical_flow.y(x, y)};
        const double there = at(sequence.last, to_x, to_y);
        if (std::isnan(there)) continue;
        with += std::fabs(there - sequence.first(x, y));
        without += std::fabs(sequence.last(x, y) - sequence.first(x, y));
      }
    }
    EXPECT_LT(with, 0.5 * without) << index;
  }
}

TEST(AffineSequences, AreRenderedOnceForSeveralSensors) {
  AffineOptions options = small();
  options.sensors = 3;
  const AffineSequences sequences(options);
  const std::vector<Sequence> all = sequences.make_all(2);
  ASSERT_EQ(all.size(), 3U);
  const Sequence alone = AffineSequences(small()).make(2);
  std::set<double> thresholds;
  for (std::uint32_t k = 0; k < 3; ++k) {
    EXPECT_EQ(all[k].index, 6 + k);
    EXPECT_TRUE(std::ranges::equal(all[k].motion_field.x.pixels(), alone.motion_field.x.pixels())) << "the same motion";
    EXPECT_FALSE(all[k].events.empty());
    thresholds.insert(nlohmann::json::parse(all[k].info)["contrast_threshold"].get<double>());
  }
  EXPECT_EQ(thresholds.size(), 3U);
}

TEST(AffineSequences, ChecksSamplingLikeAScenario) {
  AffineOptions options = small();
  const auto refused = [&] { return test::message_of<UserError>([&] { AffineSequences(options).make(0); }); };
  options.sampling = FlowSampling{0.5, {1000, 10}};
  EXPECT_TRUE(test::contains(refused(), "min_rate_hz = 1000 is above max_rate_hz = 10"));
  options.sampling = KeyframeSampling{};
  EXPECT_TRUE(test::contains(refused(), "keyframes"));
}

TEST(AffineSequences, FlowIsTheRateOfDisplacement) {
  AffineOptions options = small();
  VectorField start, middle, end;
  for (const auto& [time, motion_field] :
       {std::pair{MotionFieldTime::start, &start}, {MotionFieldTime::middle, &middle}, {MotionFieldTime::end, &end}}) {
    options.motion_field_at = time;
    *motion_field = AffineSequences(options).make(4).motion_field;
  }
  const Sequence sequence = AffineSequences(options).make(4);
  EXPECT_EQ(sequence.motion_field_t, to_ns(options.duration_s));
  for (const auto& [x, y] : {std::pair{0, 0}, {40, 10}, {63, 47}}) {
    // A cubic spline of two pieces: Simpson's rule over the whole is nearly its integral, for small optical flow.
    const double mean = (start.x(x, y) + 4 * middle.x(x, y) + end.x(x, y)) / 6 * options.duration_s;
    EXPECT_NEAR(mean, sequence.optical_flow.x(x, y), 0.02 + 0.05 * std::fabs(mean));
  }
  EXPECT_NE(start.x(0, 0), end.x(0, 0));
}

TEST(AffineSequences, EventsAccountForTheChangeOfBrightness) {
  const AffineOptions options = small();
  const AffineSequences sequences(options);
  for (const std::uint32_t index : {1U, 3U}) {
    const Sequence sequence = sequences.make(index);
    const double C = nlohmann::json::parse(sequence.info)["contrast_threshold"];
    EXPECT_GE(C, 0.2);
    EXPECT_LE(C, 0.5);
    Image<float> sum(64, 48);
    TimeNs before = 0;
    for (const Event& event : sequence.events) {
      EXPECT_GE(event.t, before);
      before = event.t;
      sum(event.x, event.y) += static_cast<float>(event.polarity * C);
    }
    EXPECT_LE(before, sequence.span.end);
    EXPECT_GT(sequence.events.size(), 100U);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      const double change = std::log((sequence.last.data()[i] + 0.001) / (sequence.first.data()[i] + 0.001));
      EXPECT_LE(std::fabs(change - sum.data()[i]), C * 1.001);
    }
  }
}

TEST(AffineSequences, DependOnNothingButOptionsAndIndex) {
  const AffineSequences one(small()), other(small());
  one.make(7);
  const Sequence a = one.make(2), b = other.make(2), next = other.make(3);
  EXPECT_EQ(a.events, b.events);
  EXPECT_EQ(a.info, b.info);
  EXPECT_NE(a.events, next.events);
  AffineOptions seeded = small();
  seeded.seed = 2;
  EXPECT_NE(AffineSequences(seeded).make(2).events, a.events);
  EXPECT_NE(AffineSequences(seeded).options(), one.options());
  EXPECT_EQ(one.options(), other.options());
}

TEST(AffineSequences, MagnitudesFollowTheTarget) {
  AffineOptions options = small();
  options.width = 32, options.height = 24;
  options.magnitudes = {{0, 1, 2, 4, 8}, {0.1, 0.4, 0.4, 0.1}, "test"};
  options.flow_scale = 1;
  options.duration_s = 0.001;
  const AffineSequences sequences(options);
  std::vector<double> fractions(5);
  for (std::uint32_t i = 0; i < 50; ++i) {
    const VectorField d = sequences.make(i).optical_flow;
    for (std::size_t k = 0; k < d.x.size(); ++k) {
      const double magnitude = std::hypot(d.x.data()[k], d.y.data()[k]);
      fractions[options.magnitudes.bin_of(magnitude)] += 0.02 / static_cast<double>(d.x.size());
    }
  }
  EXPECT_LT(fractions.back(), 0.02);
  fractions.pop_back();
  EXPECT_LT(total_variation(fractions, options.magnitudes.fractions), 0.1);
}

TEST(AffineSequences, RefuseWhatIsImpossible) {
  const auto problem = [](auto change) {
    AffineOptions options = small();
    change(options);
    return test::message_of<UserError>([&] { AffineSequences sequences(options); });
  };
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.width = 4; }), "4x48 px"));
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.duration_s = 0; }), "duration of 0 s"));
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.duration_s = NAN; }), "duration"));
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.contrast_threshold = {0.5, 0.2}; }), "from 0.5 to 0.2"));
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.mix.translation = 0; }), "translation"));
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.flow_scale = -1; }), "scale of -1"));
  EXPECT_TRUE(test::contains(problem([](auto& o) { o.images = "/nowhere"; }), "/nowhere: must be a folder"));
}

class Images : public testing::Test {
 protected:
  void write(const std::string& name, int width, int height, int level = 120) {
    std::filesystem::create_directories((folder_.path() / name).parent_path());
    cv::imwrite((folder_.path() / name).string(), cv::Mat(height, width, CV_8U, cv::Scalar(level)));
  }
  test::TemporaryDirectory folder_;
};

TEST_F(Images, AreTakenInTurnAndTheUnusablePassedOver) {
  write("a.png", 100, 80, 10);
  folder_.write("b.png", "this is not an image");
  write("c.png", 20, 200);
  write("deep/d.jpg", 64, 64, 200);
  folder_.write("notes.txt", "not looked at");
  const std::string png_of_2_to_20_squared =
      std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x10\0\0\0\x10\0\0\x08\0\0\0\0\0\0\0\0", 33);
  folder_.write("e.png", png_of_2_to_20_squared);
  const ImageFolder images(folder_.path());
  EXPECT_EQ(images.size(), 5U);
  EXPECT_EQ(images.pick(0).name, "a.png");
  EXPECT_EQ(images.pick(5).name, "a.png");
  EXPECT_EQ(images.pick(3).name, "deep/d.jpg");
  const ImageFolder::Picture picture = images.pick(1);
  EXPECT_EQ(picture.name, "deep/d.jpg");
  ASSERT_EQ(picture.passed_over.size(), 2U);
  EXPECT_TRUE(test::contains(picture.passed_over.at("b.png"), "cannot be decoded"));
  EXPECT_TRUE(test::contains(picture.passed_over.at("c.png"), "20x200 px is too small"));
  const ImageFolder::Picture around = images.pick(4);
  EXPECT_EQ(around.name, "a.png");
  EXPECT_TRUE(test::contains(around.passed_over.at("e.png"), "too large"));
}

TEST_F(Images, AreRefusedWhereNoneIsLeft) {
  const auto problem = [&] { return test::message_of<UserError>([&] { ImageFolder(folder_.path()).pick(0); }); };
  EXPECT_TRUE(test::contains(problem(), "has no images"));
  folder_.write("b.png", "this is not an image");
  EXPECT_TRUE(test::contains(problem(), "none of its 1 images can be used, for example: image"));
}

TEST_F(Images, ChangeTheFingerprint) {
  write("a.png", 100, 80);
  const std::uint32_t before = ImageFolder(folder_.path()).fingerprint();
  EXPECT_EQ(ImageFolder(folder_.path()).fingerprint(), before);
  write("b.png", 100, 80);
  EXPECT_NE(ImageFolder(folder_.path()).fingerprint(), before);
}

TEST(DeadLeaves, LookAlikeAtAllScales) {
  const Image<float> image = dead_leaves({}, 1, 0);
  EXPECT_EQ(image.pixels().size(), 512U * 512U);
  double low = 1e9, high = 0;
  for (const float value : image.pixels()) low = std::min<double>(low, value), high = std::max<double>(high, value);
  EXPECT_GE(low, 0.099);
  EXPECT_LE(high, 1.001);
  EXPECT_GT(high / low, 5);

  // Differences of brightness over a distance grow slowly with it.
  const auto mean_difference = [&](int distance) {
    double sum = 0;
    for (int y = 0; y < 512; ++y) {
      for (int x = 0; x + distance < 512; ++x) sum += std::fabs(std::log(image(x, y) / image(x + distance, y)));
    }
    return sum / (512.0 * (512 - distance));
  };
  EXPECT_LT(mean_difference(1), mean_difference(8));
  EXPECT_LT(mean_difference(8), mean_difference(64));
  EXPECT_LT(mean_difference(64), 4 * mean_difference(8));
  EXPECT_EQ(dead_leaves({}, 1, 0).pixels()[1000], image.pixels()[1000]);
  EXPECT_NE(dead_leaves({}, 1, 1).pixels()[1000], image.pixels()[1000]);
}

}  // namespace
}  // namespace esim
