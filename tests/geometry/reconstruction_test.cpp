#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "esim/core/error.h"
#include "esim/geometry/calibration.h"
#include "esim/geometry/reconstruction/colmap.h"
#include "esim/geometry/reconstruction/transforms.h"
#include "support/errors.h"
#include "support/reconstruction.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::cameras_bin;
using test::cameras_txt;
using test::contains;
using test::frame_json;
using test::images_bin;
using test::images_txt;
using test::ModelCamera;
using test::ModelImage;

/// The pixel of a point as COLMAP defines it: the centre of the first pixel is (0.5, 0.5). From the definitions in its
/// documentation, independent of esim's models.
Eigen::Vector2d colmap_pixel(const ModelCamera& camera, const Eigen::Vector3d& point) {
  const std::vector<double>& p = camera.parameters;
  const double x = point.x() / point.z(), y = point.y() / point.z(), r2 = x * x + y * y, r = std::sqrt(r2);
  const bool simple = camera.model.find("SIMPLE") == 0 || camera.model.find("RADIAL") == 0;
  const Eigen::Vector2d f(p[0], simple ? p[0] : p[1]), c(simple ? p[1] : p[2], simple ? p[2] : p[3]);
  const std::vector<double> k(p.begin() + (simple ? 3 : 4), p.end());
  const auto coefficient = [&](std::size_t i) { return i < k.size() ? k[i] : 0.0; };
  Eigen::Vector2d distorted(x, y);
  if (camera.model.find("FISHEYE") != std::string::npos) {
    const double theta = std::atan(r), t2 = theta * theta;
    double radial = 1;
    for (std::size_t i = 0; i < 4; ++i) radial += coefficient(i) * std::pow(t2, static_cast<double>(i) + 1);
    distorted *= theta * radial / r;
  } else if (camera.model == "FOV") {
    distorted *= std::atan(2 * r * std::tan(k[0] / 2)) / (k[0] * r);
  } else if (camera.model.find("OPENCV") != std::string::npos) {
    const double radial = 1 + k[0] * r2 + k[1] * r2 * r2 + coefficient(4) * r2 * r2 * r2;
    distorted = {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
                 y * radial + 2 * k[3] * x * y + k[2] * (r2 + 2 * y * y)};
  } else {
    distorted *= 1 + coefficient(0) * r2 + coefficient(1) * r2 * r2;
  }
  return f.cwiseProduct(distorted) + c;
}

const std::vector<ModelCamera> kCameras{
    {1, 0, "SIMPLE_PINHOLE", 640, 480, {500, 321, 239}},
    {2, 1, "PINHOLE", 640, 480, {500, 510, 321.5, 239.25}},
    {3, 2, "SIMPLE_RADIAL", 640, 480, {500, 321, 239, -0.05}},
    {4, 3, "RADIAL", 640, 480, {500, 321, 239, -0.05, 0.01}},
    {5, 4, "OPENCV", 640, 480, {500, 510, 321, 239, -0.05, 0.01, 1e-3, -2e-3}},
    {6, 5, "OPENCV_FISHEYE", 640, 480, {300, 310, 321, 239, -0.02, 0.01, -0.003, 0.001}},
    {7, 6, "FULL_OPENCV", 640, 480, {500, 510, 321, 239, -0.05, 0.01, 1e-3, -2e-3, 0.002, 0, 0, 0}},
    {8, 7, "FOV", 640, 480, {400, 410, 321, 239, 0.9}},
    {9, 8, "SIMPLE_RADIAL_FISHEYE", 640, 480, {300, 321, 239, -0.02}},
    {20, 9, "RADIAL_FISHEYE", 640, 480, {300, 321, 239, -0.02, 0.004}}};

const std::vector<ModelImage> kImages{
    {3, Eigen::Quaterniond(1, 0.1, -0.2, 0.3).normalized(), {1, 2, 3}, 1, "b/img10.png", 2},
    {7, Eigen::Quaterniond(-0.4, 0.1, 0.2, 0.3).normalized(), {-1, 0.5, 2}, 1, "b/img9.png", 0}};

class Reconstruction : public testing::Test {
 protected:
  std::vector<CalibratedCamera> read(const std::string& name, const std::string& content) const {
    return read_calibration(folder_.write(name, content));
  }
  std::string error(const std::string& name, const std::string& content) const {
    return test::message_of<UserError>([&] { read(name, content); });
  }
  std::string image_error(const std::string& name, const std::string& content) const {
    return test::message_of<UserError>([&] { read_colmap_images(folder_.write(name, content)); });
  }
  test::TemporaryDirectory folder_;
};

void expect_same(const Camera& a, const Camera& b, double tolerance = 0) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_NEAR(a.fx, b.fx, tolerance);
  EXPECT_NEAR(a.fy, b.fy, tolerance);
  EXPECT_NEAR(a.cx, b.cx, tolerance);
  EXPECT_NEAR(a.cy, b.cy, tolerance);
  EXPECT_EQ(a.distortion.index(), b.distortion.index());
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.3, -0.2, 1), Eigen::Vector3d(-0.5, 0.4, 1.2)})
    EXPECT_LE((a.project(point)->pixel - b.project(point)->pixel).norm(), tolerance);
}

TEST_F(Reconstruction, ProjectsAsColmapDefinesItsModels) {
  for (const std::string name : {"cameras.txt", "cameras.bin"}) {
    const auto cameras = read(name, name == "cameras.txt" ? cameras_txt(kCameras) : cameras_bin(kCameras));
    ASSERT_EQ(cameras.size(), kCameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      EXPECT_EQ(cameras[i].name, fmt::format("camera{}", kCameras[i].id));
      EXPECT_TRUE(cameras[i].T_body_camera.matrix().isIdentity(0));
      for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.31, -0.22, 1), Eigen::Vector3d(-0.8, 0.5, 2)}) {
        const auto projection = cameras[i].model.project(point);
        ASSERT_TRUE(projection) << kCameras[i].model;
        const Eigen::Vector2d expected = colmap_pixel(kCameras[i], point) - Eigen::Vector2d(0.5, 0.5);
        EXPECT_LT((projection->pixel - expected).norm(), 1e-10) << kCameras[i].model;
      }
    }
  }
}

TEST_F(Reconstruction, FindsTheCamerasOfAModel) {
  folder_.write("images.txt", images_txt(kImages));
  EXPECT_TRUE(contains(test::message_of<UserError>([&] { read_calibration(folder_.path()); }),
                       "contains neither cameras.bin nor cameras.txt nor transforms.json; name the folder"));
  folder_.write("cameras.txt", cameras_txt({kCameras[3], kCameras[0]}));
  EXPECT_EQ(read_calibration(folder_.path())[0].name, "camera1");  // by number
  EXPECT_EQ(read_calibration(folder_.path() / "images.txt").size(), 2U);
  folder_.write("cameras.bin", cameras_bin({kCameras[1]}));
  EXPECT_EQ(read_calibration(folder_.path())[0].name, "camera2");  // .bin is preferred
  EXPECT_EQ(read_calibration(folder_.path() / "cameras.txt").size(), 2U);
}

TEST_F(Reconstruction, NamesModelsThatAreNotSupported) {
  ModelCamera prism{1, 10, "THIN_PRISM_FISHEYE", 640, 480, std::vector<double>(12, 1.0)};
  const std::string reason =
      "camera model THIN_PRISM_FISHEYE is not supported; supported are SIMPLE_PINHOLE, PINHOLE, ";
  EXPECT_TRUE(contains(error("cameras.bin", cameras_bin({prism})), reason));
  EXPECT_TRUE(contains(error("cameras.txt", cameras_txt({prism})),
                       "cameras.txt:3: camera model 'THIN_PRISM_FISHEYE' is not supported"));
  for (const std::int32_t number : {-1, 18, 2000000000}) {
    prism.number = number;
    EXPECT_TRUE(contains(error("cameras.bin", cameras_bin({prism})), fmt::format("camera model {} is not", number)));
  }
  ModelCamera full = kCameras[6];
  full.parameters[10] = 0.1;
  EXPECT_TRUE(contains(error("cameras.bin", cameras_bin({full})),
                       "camera 7: k4, k5 and k6 of FULL_OPENCV are 0, 0.1 and 0; only 0 is supported"));
}

TEST_F(Reconstruction, RefusesMalformedCameras) {
  const auto with = [&](const std::function<void(ModelCamera&)>& change) {
    ModelCamera camera = kCameras[1];
    change(camera);
    return error("cameras.bin", cameras_bin({camera}));
  };
  const double nan = std::nan("");
  EXPECT_TRUE(contains(with([&](ModelCamera& c) { c.parameters[0] = nan; }), "camera 2: camera: fx is"));
  EXPECT_TRUE(contains(with([&](ModelCamera& c) { c.parameters[3] = HUGE_VAL; }), "camera 2: camera: cy is"));
  EXPECT_TRUE(contains(with([&](ModelCamera& c) { c.parameters[1] = 0; }), "camera 2: camera: fy is"));
  EXPECT_TRUE(contains(with([&](ModelCamera& c) { c.width = 0; }), "camera 2: the image size is 0 x 480 px"));
  EXPECT_TRUE(contains(with([&](ModelCamera& c) { c.height = std::uint64_t(-1); }), "positive integers up to 16384"));
  EXPECT_TRUE(contains(error("cameras.bin", cameras_bin({kCameras[1], kCameras[1]})), "camera 2: occurs twice"));
  EXPECT_TRUE(contains(error("cameras.bin", cameras_bin({})), "contains no cameras"));
  EXPECT_TRUE(contains(error("cameras.txt", ""), "contains no cameras"));
  EXPECT_TRUE(contains(error("cameras.txt", "#\n1 PINHOLE 640 480 1 2 3\n"),
                       "cameras.txt:2: the model PINHOLE must have 4 parameters, not 3"));
  EXPECT_TRUE(contains(error("cameras.txt", "1 PINHOLE 640 480 1 2 3 inf"), "parameter must be a finite number"));
  EXPECT_TRUE(contains(error("cameras.txt", "1 PINHOLE -640 480 1 2 3 4"), "WIDTH must be a non-negative integer"));
  EXPECT_TRUE(contains(error("cameras.txt", "1\n"), "MODEL is missing"));
}

TEST_F(Reconstruction, ReadsTheSameImagesFromBothFormats) {
  const auto text = read_colmap_images(folder_.write("images.txt", images_txt(kImages)));
  const auto binary = read_colmap_images(folder_.write("images.bin", images_bin(kImages)));
  ASSERT_EQ(text.size(), 2U);
  ASSERT_EQ(binary.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(text[i].id, kImages[i].id);
    EXPECT_EQ(binary[i].id, kImages[i].id);
    EXPECT_EQ(text[i].name, kImages[i].name);
    EXPECT_EQ(binary[i].name, kImages[i].name);
    EXPECT_EQ(text[i].T_camera_world.matrix(), binary[i].T_camera_world.matrix());
    EXPECT_LT((text[i].T_camera_world.rotation.coeffs() - kImages[i].q.coeffs()).norm(), 1e-15);
    EXPECT_EQ(text[i].T_camera_world.translation, kImages[i].t);
  }
}

TEST_F(Reconstruction, TruncatedFilesAreErrors) {
  const std::string cameras = cameras_bin(kCameras), images = images_bin(kImages);
  for (std::size_t size = 0; size < cameras.size(); ++size)
    EXPECT_TRUE(contains(error("cameras.bin", cameras.substr(0, size)), "cameras.bin: byte")) << size;
  for (std::size_t size = 0; size < images.size(); ++size)
    EXPECT_TRUE(contains(image_error("images.bin", images.substr(0, size)), "images.bin: byte")) << size;
  EXPECT_TRUE(contains(error("cameras.bin", cameras + "x"), "1 bytes follow after the last of the cameras"));
  EXPECT_TRUE(contains(image_error("images.bin", images + "xyz"), "3 bytes follow after the last of the images"));
  // Text may end anywhere: with an error, or with fewer digits.
  const std::string camera_lines = cameras_txt(kCameras), image_lines = images_txt(kImages);
  for (std::size_t size = 0; size < camera_lines.size(); ++size) error("cameras.txt", camera_lines.substr(0, size));
  for (std::size_t size = 0; size < image_lines.size(); ++size) image_error("images.txt", image_lines.substr(0, size));
}

TEST_F(Reconstruction, HostileCountsAreErrors) {
  for (const std::uint64_t count :
       {std::uint64_t{11}, std::uint64_t{1} << 32, std::uint64_t{1} << 60, std::numeric_limits<std::uint64_t>::max()}) {
    std::string cameras = cameras_bin(kCameras), images = images_bin(kImages);
    cameras.replace(0, 8, reinterpret_cast<const char*>(&count), 8);
    images.replace(0, 8, reinterpret_cast<const char*>(&count), 8);
    EXPECT_TRUE(contains(error("cameras.bin", cameras), "cameras.bin: byte"));
    EXPECT_TRUE(contains(image_error("images.bin", images), "images.bin: byte"));
    std::string points = images_bin({kImages[1]});
    points.replace(points.size() - 8, 8, reinterpret_cast<const char*>(&count), 8);
    EXPECT_TRUE(contains(image_error("images.bin", points),
                         fmt::format("image 1 of 1: {} points cannot fit into the remaining 0 bytes", count)));
  }
  ModelImage image = kImages[0];
  image.name = std::string(10000, 'a');
  EXPECT_TRUE(contains(image_error("images.bin", images_bin({image})), "is longer than 4096 characters"));
}

TEST_F(Reconstruction, RefusesMalformedImages) {
  ModelImage image = kImages[0];
  image.q.coeffs().setZero();
  EXPECT_TRUE(contains(image_error("images.bin", images_bin({image})), "image 1 of 1: the quaternion is zero"));
  EXPECT_TRUE(contains(image_error("images.txt", images_txt({image})), "images.txt:2: the quaternion is zero"));
  image.q.w() = std::nan("");
  EXPECT_TRUE(contains(image_error("images.bin", images_bin({image})), "the quaternion is not finite"));
  EXPECT_TRUE(contains(image_error("images.txt", images_txt({image})), "images.txt:2: QW must be a finite number"));
  image.q.coeffs().setConstant(1e308);
  EXPECT_TRUE(contains(image_error("images.bin", images_bin({image})), "the quaternion is too large"));
  image = kImages[0];
  image.t.y() = -HUGE_VAL;
  EXPECT_TRUE(contains(image_error("images.bin", images_bin({image})), "the translation is not finite"));
  EXPECT_TRUE(contains(image_error("images.txt", "1 1 0 0 0 0 0 0 1\n"), "images.txt:1: NAME is missing"));
  EXPECT_TRUE(contains(image_error("images.txt", "1 1 0 0\n"), "images.txt:1: QZ is missing"));
  EXPECT_TRUE(contains(image_error("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n2 1 0 0 0 0 0 0 1 b c.png\n"),
                       "images.txt:2: after the line of an image, its points must follow"));
}

TEST_F(Reconstruction, TransformsGiveTheCamerasOfColmap) {
  const auto colmap = read("cameras.txt", cameras_txt({kCameras[4], kCameras[5], kCameras[1]}));
  const std::string frame = frame_json(kImages[0]);
  const auto opencv =
      read("transforms.json",
           test::transforms_json(R"("camera_model": "OPENCV", "w": 640, "h": 480.0, "fl_x": 500, "fl_y": 510,
      "cx": 321, "cy": 239, "k1": -0.05, "k2": 0.01, "p1": 1e-3, "p2": -2e-3)",
                                 {frame, frame}));
  ASSERT_EQ(opencv.size(), 1U);
  EXPECT_EQ(opencv[0].name, "camera1");
  EXPECT_TRUE(opencv[0].T_body_camera.matrix().isIdentity(0));
  const std::string fisheye = R"("w": 640, "h": 480, "fl_x": 300, "fl_y": 310, "cx": 321, "cy": 239, "k1": -0.02,
      "k2": 0.01, "k3": -0.003, "k4": 0.001, )";
  // By their number, the fisheye camera is the last one of the model.
  for (const CalibratedCamera& camera : colmap) {
    if (camera.name == "camera5") expect_same(opencv[0].model, camera.model);
    if (camera.name != "camera6") continue;
    for (const std::string kind : {R"("camera_model": "OPENCV_FISHEYE")", R"("is_fisheye": true)"})
      expect_same(read("fisheye.json", test::transforms_json(fisheye + kind, {frame}))[0].model, camera.model);
  }
}

TEST_F(Reconstruction, TransformsHaveDefaultsAndSeveralCameras) {
  // The field of view is 2 atan(0.5 * 640 / 320); the principal point is in the middle of the image.
  const std::string angle = fmt::format(R"("camera_angle_x": {}, "w": 640, "h": 480)", std::acos(0.0));
  const auto pinhole = read("transforms.json", test::transforms_json(angle, {frame_json(kImages[0])}));
  expect_same(pinhole[0].model, Camera{640, 480, 320, 320, 319.5, 239.5, NoDistortion{}}, 1e-12);
  const auto several =
      read("transforms.json", test::transforms_json(R"("w": 640, "h": 480, "fl_x": 400)",
                                                    {frame_json(kImages[0]), frame_json(kImages[1], R"(, "fl_x": 500)"),
                                                     frame_json(kImages[1])}));
  ASSERT_EQ(several.size(), 2U);
  EXPECT_EQ(several[0].model.fy, 400);
  EXPECT_EQ(several[1].model.fx, 500);
  EXPECT_EQ(several[1].name, "camera2");
}

TEST_F(Reconstruction, RefusesMalformedTransforms) {
  const std::string intrinsics = R"("w": 640, "h": 480, "fl_x": 400)";
  const auto with = [&](const std::string& more, const std::string& frame) {
    return error("transforms.json", test::transforms_json(more, {frame}));
  };
  const std::string frame = frame_json(kImages[0]);
  EXPECT_TRUE(contains(with(R"("h": 480)", frame), "frames[0]: w, the width of the images in px, is missing"));
  EXPECT_TRUE(contains(with(R"("w": 4, "h": 480)", frame), "fl_x and camera_angle_x are missing"));
  EXPECT_TRUE(contains(with(intrinsics + R"(, "k1": "a")", frame), "k1 must be a number"));
  EXPECT_TRUE(contains(with(intrinsics + R"(, "k4": 1)", frame), "k4 is only supported for OPENCV_FISHEYE"));
  EXPECT_TRUE(contains(with(intrinsics + R"(, "camera_model": "EQUIRECTANGULAR")", frame),
                       "camera_model 'EQUIRECTANGULAR' is not supported; supported are OPENCV, OPENCV_FISHEYE"));
  EXPECT_TRUE(contains(with(R"("w": 640.5, "h": 480, "fl_x": 1)", frame), "the image size is 640.5 x 480 px"));
  EXPECT_TRUE(contains(with(R"("w": 640, "h": 480, "fl_x": -1)", frame), "frames[0]: camera: fx is"));
  EXPECT_TRUE(contains(with(R"("w": 640, "h": 480, "camera_angle_x": 0)", frame), "frames[0]: camera: fx is"));
  EXPECT_TRUE(contains(with(intrinsics, "3"), "frames[0]: must be an object"));
  EXPECT_TRUE(contains(error("t.json", R"({"frames": []})"), "frames is empty"));
  EXPECT_TRUE(
      contains(error("t.json", R"({"frames": 3})"), "must be a transforms.json, an object with a list of frames"));
  EXPECT_TRUE(contains(error("t.json", R"({"frames": [1e999]})"), "a number that is not finite"));
  EXPECT_TRUE(contains(error("t.json", R"({"frames": [NaN]})"), "t.json: byte 13: is not valid JSON"));
  EXPECT_TRUE(contains(error("t.json", R"("frames": )" + std::string(100000, '[')), "is not valid JSON"));
  EXPECT_TRUE(contains(error("t.json", R"({"frames": )" + std::string(100000, '[')), "is not valid JSON"));
  const std::string complete = test::transforms_json(intrinsics, {frame});
  for (std::size_t size = 0; size + 2 < complete.size(); ++size)
    EXPECT_NE(error("transforms.json", complete.substr(0, size)), "nothing was thrown") << size;
  // A calibration of another format may have this extension.
  EXPECT_EQ(
      read("chain.json", R"({"cam0": {"camera_model": "pinhole", "intrinsics": [1, 1, 1, 1], "resolution": [4, 4]}})")
          .size(),
      1U);
}

TEST_F(Reconstruction, RefusesMalformedMatrices) {
  const auto with = [&](const std::string& matrix) {
    const auto file = folder_.write("m.json", R"({"frames": [{"transform_matrix": )" + matrix + "}]}");
    return test::message_of<UserError>([&] { read_transforms_frames(file); });
  };
  EXPECT_TRUE(contains(with("null"), "frames[0]: transform_matrix must be a matrix of 4 x 4 numbers"));
  EXPECT_TRUE(contains(with("[[1, 0, 0, 0]]"), "must be a matrix"));
  EXPECT_TRUE(contains(with("[[1,0,0,0],[0,1,0,0],[0,0,1],[0,0,0,1]]"), "must be a matrix"));
  EXPECT_TRUE(contains(with("[[1,0,0,0],[0,1,0,0],[0,0,\"1\",0],[0,0,0,1]]"), "must be a matrix"));
  EXPECT_TRUE(contains(with("[[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]"), "is not a rotation"));
  EXPECT_TRUE(contains(with("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), "is a reflection"));
  EXPECT_TRUE(contains(with("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]"), "the last row"));
  EXPECT_EQ(with("[[1,0,0,5],[0,1,0,0],[0,0,1,0]]"), "nothing was thrown");
}

}  // namespace
}  // namespace esim
