#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/error.h"
#include "esim/geometry/calibration.h"
#include "esim/motion/files/natural_order.h"
#include "esim/motion/trajectory_file.h"
#include "support/errors.h"
#include "support/reconstruction.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;
using test::frame_json;
using test::ModelImage;
using test::transforms_json;

/// Cameras that look along y, with z towards the upper side of their images, and that turn a little.
std::vector<ModelImage> some_images(int count) {
  std::vector<ModelImage> images;
  for (int i = 0; i < count; ++i) {
    ModelImage image;
    image.id = static_cast<std::uint32_t>(100 - i);
    image.q = Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d(0.1, 1, 0.2).normalized())) *
              Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
    image.t = {0.1 * i, 0.02 * i, 1 - 0.01 * i};
    image.name = fmt::format("cam/img{}.png", i + 8);  // img8, img9, img10, ...
    image.points = i % 3;
    images.push_back(image);
  }
  std::reverse(images.begin(), images.end());  // the order of a file means nothing
  return images;
}

class ImagePosesFile : public testing::Test {
 protected:
  TrajectoryFile read(const std::string& name, const std::string& content, const TrajectoryFileOptions& options = {}) {
    return read_trajectory_file(folder_.write(name, content), options);
  }
  std::string error(const std::string& name, const std::string& content, const TrajectoryFileOptions& options = {}) {
    return test::message_of<UserError>([&] { read(name, content, options); });
  }
  test::TemporaryDirectory folder_;
};

void expect_same(const std::vector<TimedPose>& a, const std::vector<TimedPose>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].t, b[i].t);
    EXPECT_LE((a[i].T_world_body.matrix() - b[i].T_world_body.matrix()).cwiseAbs().maxCoeff(), tolerance);
  }
}

TEST(NaturalOrder, ComparesNumbersAsNumbers) {
  const std::vector<std::string> sorted{
      "",  "01", "1",    "1a",   "2", "10", "a", "a/img9.png", "a/img009.jpg", "a/img10.png", "a/img0100.png",
      "b", "b1", "b1c2", "b1c10"};
  EXPECT_TRUE(natural_less("a/img009.jpg", "a/img10.png"));
  EXPECT_TRUE(natural_less("img9", "img10"));
  EXPECT_FALSE(natural_less("img10", "img9"));
  EXPECT_TRUE(natural_less("9", "99999999999999999999999999"));
  for (const std::string& a : sorted) {
    EXPECT_FALSE(natural_less(a, a));
    for (const std::string& b : sorted)
      EXPECT_TRUE(a == b || natural_less(a, b) != natural_less(b, a)) << a << ' ' << b;
  }
}

TEST_F(ImagePosesFile, ColmapGivesTheSamePosesAsTextAndBinary) {
  const std::vector<ModelImage> images = some_images(5);
  const TrajectoryFile binary = read("images.bin", test::images_bin(images));
  const TrajectoryFile text = read("images.txt", test::images_txt(images));
  expect_same(binary.poses, text.poses, 0);
  expect_same(read_trajectory(folder_.path()), text.poses, 0);
  ASSERT_EQ(text.poses.size(), 5U);
  EXPECT_EQ(text.rate_hz, 30);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(text.poses[i].t, std::llround(static_cast<double>(i) * 1e9 / 30));
    const ModelImage& image = images[4 - i];  // img8 first
    EXPECT_LT((text.poses[i].T_world_body.inverse().translation - image.t).norm(), 1e-14);
  }
  const TrajectoryFile slow = read("images.txt", test::images_txt(images), {.rate_hz = 4.0});
  EXPECT_EQ(slow.rate_hz, 4);
  EXPECT_EQ(slow.poses[3].t, 750'000'000);
}

TEST_F(ImagePosesFile, ProjectsAsColmapDefines) {
  const std::vector<ModelImage> images = some_images(3);
  folder_.write("images.bin", test::images_bin(images));
  folder_.write("cameras.bin", test::cameras_bin({{.parameters = {500, 510, 320.25, 240.75}}}));
  const Camera camera = read_calibration(folder_.path())[0].model;
  const auto poses = read_trajectory(folder_.path());
  const Eigen::Vector3d point(0.2, 3, -0.4);
  for (std::size_t i = 0; i < 3; ++i) {
    const ModelImage& image = images[2 - i];
    // COLMAP: pixel = f x / z + c with x = R p + t; the centre of the first pixel is (0.5, 0.5), that of esim (0, 0).
    const Eigen::Vector3d x = image.q * point + image.t;
    const Eigen::Vector2d expected(500 * x.x() / x.z() + 320.25 - 0.5, 510 * x.y() / x.z() + 240.75 - 0.5);
    const auto projection = camera.project(poses[i].T_world_body.inverse() * point);
    ASSERT_TRUE(projection);
    EXPECT_LT((projection->pixel - expected).norm(), 1e-10);
  }
}

TEST_F(ImagePosesFile, TransformsGiveThePosesOfColmap) {
  const std::vector<ModelImage> images = some_images(12);
  std::vector<std::string> frames;
  for (const ModelImage& image : images) frames.push_back(frame_json(image));
  const TrajectoryFile transforms = read("transforms.json", transforms_json("", frames), {.rate_hz = 10.0});
  expect_same(transforms.poses, read("images.txt", test::images_txt(images), {.rate_hz = 10.0}).poses, 1e-13);
  EXPECT_EQ(transforms.rate_hz, 10);
}

TEST_F(ImagePosesFile, TimesOfTransformsAreStamps) {
  const std::vector<ModelImage> images = some_images(3);  // img10, img9, img8
  for (const std::string key : {"time", "timestamp"}) {
    std::vector<std::string> frames;
    for (std::size_t i = 0; i < 3; ++i)
      frames.push_back(frame_json(images[i], fmt::format(R"(, "{}": {})", key, std::vector<double>{2.5, 1, 2}[i])));
    const std::string text = transforms_json("", frames);
    const TrajectoryFile file = read("transforms.json", text);
    EXPECT_FALSE(file.rate_hz);
    ASSERT_EQ(file.poses.size(), 3U);
    EXPECT_EQ(file.poses[0].t, 1'000'000'000);
    EXPECT_EQ(file.poses[2].t, 2'500'000'000);
    EXPECT_LT((file.poses[0].T_world_body.inverse().translation - images[1].t).norm(), 1e-14);
    EXPECT_TRUE(contains(error("transforms.json", text, {.rate_hz = 30.0}),
                         "transforms.json: the file has stamps, so that rate_hz must not be given"));
    frames[1] = frame_json(images[1], fmt::format(R"(, "{}": 2.5)", key));
    EXPECT_TRUE(
        contains(error("transforms.json", transforms_json("", frames)), "the stamp 2500000000 ns occurs twice"));
    frames[1] = frame_json(images[1], fmt::format(R"(, "{}": 1.7e18)", key));
    EXPECT_TRUE(contains(error("transforms.json", transforms_json("", frames)), "times are in seconds"));
    frames[1] = frame_json(images[1]);  // a frame without a time: by name
    EXPECT_EQ(read("transforms.json", transforms_json("", frames)).poses[1].t, 33'333'333);
  }
}

TEST_F(ImagePosesFile, GivesTheMeanUpperSideOfImages) {
  const TrajectoryFile file = read("images.txt", test::images_txt(some_images(3)));
  ASSERT_TRUE(file.image_up);
  EXPECT_NEAR(file.image_up->norm(), 1, 1e-15);
  EXPECT_GT(file.image_up->z(), 0.98);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const ModelImage& image : some_images(3)) mean -= image.q.conjugate() * Eigen::Vector3d::UnitY();
  EXPECT_LT((*file.image_up - mean.normalized()).norm(), 1e-14);
  // With `up`, it becomes z, and the answer in the file's coordinates stays the same.
  const TrajectoryFile turned = read("images.txt", test::images_txt(some_images(3)), {.up = file.image_up});
  EXPECT_EQ(*turned.image_up, *file.image_up);
  mean.setZero();
  for (const TimedPose& pose : turned.poses) mean -= pose.T_world_body.rotation * Eigen::Vector3d::UnitY();
  EXPECT_LT((mean.normalized() - Eigen::Vector3d::UnitZ()).norm(), 1e-14);
  // Images on their heads and upright: no common direction.
  std::vector<ModelImage> images = some_images(2);
  images[1].q = Eigen::Quaterniond(0, 0, 0, 1) * images[0].q;
  EXPECT_FALSE(read("images.txt", test::images_txt(images)).image_up);
}

TEST_F(ImagePosesFile, ScaleAndUpApplyToEveryFormat) {
  const std::string tum = "0 1 2 3 0 0 0 1\n1 2 2 3 0.5 0.5 0.5 0.5\n";
  const auto poses = read("motion.txt", tum, {.scale = 2, .up = Eigen::Vector3d(0, -1, 0)}).poses;
  // -y becomes z by a quarter turn about x, so that y becomes -z and z becomes y.
  EXPECT_LT((poses[0].T_world_body.translation - Eigen::Vector3d(2, 6, -4)).norm(), 1e-14);
  EXPECT_LT((poses[0].T_world_body.rotation * Eigen::Vector3d(0, -1, 0) - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  const auto half_turn =
      read("motion.csv", "0,1,2,3,0,0,0,1\n1,2,2,3,0,0,0,1\n", {.up = Eigen::Vector3d(0, 0, -3)}).poses;
  EXPECT_EQ(half_turn[0].T_world_body.translation, Eigen::Vector3d(1, -2, -3));
  const std::string images = test::images_txt(some_images(3));
  const auto same = read("images.txt", images).poses, scaled = read("images.txt", images, {.scale = 0.1}).poses;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((scaled[i].T_world_body.translation - 0.1 * same[i].T_world_body.translation).norm(), 1e-15);
    EXPECT_EQ(scaled[i].T_world_body.rotation.coeffs(), same[i].T_world_body.rotation.coeffs());
  }
}

TEST_F(ImagePosesFile, RefusesOptionsThatAreNotValid) {
  const std::string tum = "0 1 2 3 0 0 0 1\n1 2 2 3 0 0 0 1\n";
  EXPECT_TRUE(contains(error("motion.txt", tum, {.rate_hz = 30.0}),
                       "motion.txt: the file has stamps, so that rate_hz must not be given; remove it"));
  EXPECT_TRUE(contains(error("motion.txt", tum, {.scale = 0}), "scale must be a positive number, not 0"));
  EXPECT_TRUE(contains(error("motion.txt", tum, {.scale = std::nan("")}), "scale must be a positive number"));
  EXPECT_TRUE(contains(error("motion.txt", tum, {.up = Eigen::Vector3d(0, 0, 0)}), "up must be a direction"));
  const std::string images = test::images_txt(some_images(3));
  EXPECT_TRUE(contains(error("images.txt", images, {.rate_hz = -1.0}), "rate_hz must be a positive number, not -1"));
  EXPECT_TRUE(contains(error("images.txt", images, {.rate_hz = 1e-300}), "set a larger rate_hz"));
  EXPECT_TRUE(contains(error("motion.txt", "0 1e300 2 3 0 0 0 1\n1 2 2 3 0 0 0 1\n", {.scale = 1e300}),
                       "a position times scale is too large"));
}

TEST_F(ImagePosesFile, NeedsTwoImagesWithDifferentNames) {
  EXPECT_TRUE(
      contains(error("images.bin", test::images_bin({})), "images.bin: 0 images, but a motion needs at least two"));
  EXPECT_TRUE(contains(error("images.txt", test::images_txt(some_images(1))), "images.txt: 1 image, but"));
  EXPECT_TRUE(contains(error("transforms.json", transforms_json("", {frame_json(some_images(1)[0])})), "1 image, but"));
  std::vector<ModelImage> images = some_images(3);
  images[2].name = images[0].name;
  EXPECT_TRUE(contains(error("images.txt", test::images_txt(images)), "image cam/img10.png occurs twice"));
  images[1].name.clear();
  EXPECT_TRUE(contains(error("transforms.json", transforms_json("", {frame_json(images[0]), frame_json(images[1])})),
                       "a frame has neither file_path nor time"));
}

TEST_F(ImagePosesFile, JsonWithoutFramesIsAnError) {
  EXPECT_TRUE(
      contains(error("poses.json", "{}"), "poses.json: must be a transforms.json, an object with a list of frames"));
  EXPECT_TRUE(contains(error("poses.json", "0 1 2 3 0 0 0 1\n"), "poses.json: byte 3: is not valid JSON"));
}

TEST_F(ImagePosesFile, TruncatedModelsAreErrors) {
  const std::string bytes = test::images_bin(some_images(4));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_TRUE(contains(error("images.bin", bytes.substr(0, size)), "images.bin: byte")) << size;
  EXPECT_NO_THROW(read("images.bin", bytes));
}

}  // namespace
}  // namespace esim
