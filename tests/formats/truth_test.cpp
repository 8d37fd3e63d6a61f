#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "esim/core/colour/srgb.h"
#include "esim/core/error.h"
#include "esim/formats/hdf5/truth.h"
#include "esim/formats/images/images_png.h"
#include "esim/formats/images/png_file.h"
#include "esim/formats/text/poses_tum.h"
#include "esim/recording/fan_out.h"
#include "formats/recordings.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::TemporaryDirectory;
using test::TruthImages;

SE3 some_pose(double t_s) {
  SE3 pose;
  pose.rotation = Eigen::AngleAxisd(t_s, Eigen::Vector3d(1, 2, 3).normalized());
  pose.translation = {std::sin(t_s), -1e-7 * t_s, 1234.5};
  return pose;
}

template <typename T>
std::vector<T> read_dataset(const std::filesystem::path& path, const char* name, hid_t type,
                            const std::vector<hsize_t>& shape) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
  const hid_t space = H5Dget_space(dataset);
  std::vector<hsize_t> found(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, found.data(), nullptr);
  EXPECT_EQ(found, shape) << name;
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(dataset);
  H5Fclose(file);
  return values;
}

TEST(TruthHdf5, HoldsWhatWasWritten) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "truth.h5";
  constexpr hsize_t kFrames = 5, kRows = 7, kColumns = 9;
  for (const auto compression : {Compression::blosc, Compression::gzip, Compression::none}) {
    TruthHdf5Writer writer(path, 0, {true, true, compression});
    writer.begin(test::recording_info(kColumns, kRows, 0, kNsPerSecond));
    for (std::size_t i = 0; i < kFrames; ++i) {
      const double t_s = 0.1 * static_cast<double>(i);
      writer.write(TruthImages(kColumns, kRows, t_s).at(to_ns(t_s), some_pose(t_s)));
    }
    writer.end(true);

    const auto t = read_dataset<std::int64_t>(path, "t", H5T_NATIVE_INT64, {kFrames});
    const auto poses = read_dataset<double>(path, "T_world_camera", H5T_NATIVE_DOUBLE, {kFrames, 7});
    const auto depth = read_dataset<float>(path, "depth", H5T_NATIVE_FLOAT, {kFrames, kRows, kColumns});
    const auto motion_field =
        read_dataset<float>(path, "motion_field", H5T_NATIVE_FLOAT, {kFrames, 2, kRows, kColumns});
    for (std::size_t i = 0; i < kFrames; ++i) {
      const double t_s = 0.1 * static_cast<double>(i);
      const TruthImages images(kColumns, kRows, t_s);
      EXPECT_EQ(t[i], to_ns(t_s));
      EXPECT_EQ(poses[7 * i + 2], 1234.5);
      EXPECT_EQ(poses[7 * i + 6], some_pose(t_s).rotation.w());
      const std::size_t n = kRows * kColumns;
      EXPECT_TRUE(std::equal(images.depth.data(), images.depth.data() + n, &depth[i * n]));
      EXPECT_TRUE(std::equal(images.motion_x.data(), images.motion_x.data() + n, &motion_field[2 * i * n]));
      EXPECT_TRUE(std::equal(images.motion_y.data(), images.motion_y.data() + n, &motion_field[(2 * i + 1) * n]));
    }
  }
}

TEST(TruthHdf5, OptionsAndBytes) {
  const TemporaryDirectory directory;
  std::string bytes[2];
  for (std::string& content : bytes) {
    const auto path = directory.path() / "truth.h5";
    TruthHdf5Writer writer(path, 0, {true, false});
    writer.begin(test::recording_info(8, 6, 0, kNsPerSecond));
    writer.write(TruthImages(8, 6, 0).at(0));
    writer.end(true);
    content = test::content(path);
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
  EXPECT_EQ(bytes[0].find("motion_field"), std::string::npos);
}

TEST(TruthHdf5, HoldsObjectsByNameAndOpticalFlowBetweenFrames) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "truth.h5";
  TruthHdf5Writer writer(path, 0, {false, false, Compression::gzip, true, true});
  RecordingInfo info = test::recording_info(4, 3, 0, kNsPerSecond);
  info.objects = {"a car", "bird"};
  writer.begin(info);
  Image<std::uint16_t> object(4, 3);
  Image<std::uint8_t> visible(4, 3, 1);
  const TruthImages images(4, 3, 0);
  for (std::uint16_t k = 0; k < 3; ++k) {
    object(k, 1) = k;
    TruthRecord truth = images.at(k);
    EXPECT_THROW(writer.write(truth), InternalError) << "objects are missing";
    const SE3 poses[] = {some_pose(k), some_pose(k + 0.5)};
    const TruthRecord complete{0,       k,    {}, images.irradiance, images.depth, images.motion_x, images.motion_y,
                               &object, poses};
    writer.write(complete);
    visible(0, 0) = static_cast<std::uint8_t>(k % 2);
    if (k > 0) writer.write(OpticalFlowRecord{0, k - 1, k, images.motion_x, images.motion_y, visible});
    writer.write(OpticalFlowRecord{1, 0, 1, images.motion_x, images.motion_y, visible});  // of another camera
  }
  writer.end(true);

  const auto objects = read_dataset<std::uint16_t>(path, "objects", H5T_NATIVE_UINT16, {3, 3, 4});
  EXPECT_EQ(objects[12 + 4 + 1], 1);
  EXPECT_EQ(objects[24 + 4 + 2], 2);
  EXPECT_EQ(objects[24 + 4 + 3], 0);
  const auto poses = read_dataset<double>(path, "T_world_objects", H5T_NATIVE_DOUBLE, {3, 2, 7});
  EXPECT_EQ(poses[14 + 7], some_pose(1.5).translation.x());
  EXPECT_EQ(poses[28 + 6], some_pose(2).rotation.w());
  const auto optical_flow = read_dataset<float>(path, "optical_flow", H5T_NATIVE_FLOAT, {2, 2, 3, 4});
  EXPECT_EQ(optical_flow[12], images.motion_y(0, 0));
  EXPECT_EQ(optical_flow[24 + 5], images.motion_x(1, 1));
  const auto valid = read_dataset<std::uint8_t>(path, "optical_flow_valid", H5T_NATIVE_UINT8, {2, 3, 4});
  EXPECT_EQ(valid[0], 1);
  EXPECT_EQ(valid[12], 0);

  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(file, "objects", H5P_DEFAULT), names = H5Aopen(dataset, "names", H5P_DEFAULT);
  const hid_t type = H5Aget_type(names), space = H5Aget_space(names);
  EXPECT_EQ(H5Sget_simple_extent_npoints(space), 3);
  EXPECT_EQ(H5Tget_size(type), 7U);
  std::string cells(21, 'x');
  H5Aread(names, type, cells.data());
  EXPECT_EQ(cells, std::string("static\0a car\0\0bird\0\0\0", 21));
  H5Sclose(space);
  H5Tclose(type);
  H5Aclose(names);
  H5Dclose(dataset);
  H5Fclose(file);
}

TEST(TruthHdf5, FullDisk) {
  const TemporaryDirectory directory;
  testing::internal::CaptureStderr();
  for (const rlim_t limit : {rlim_t{0}, rlim_t{3000}, rlim_t{20'000}}) {
    const test::FileSizeLimit full(limit);
    EXPECT_THROW(
        {
          TruthHdf5Writer writer(directory.path() / "truth.h5", 0);
          writer.begin(test::recording_info(64, 48, 0, kNsPerSecond));
          for (int i = 0; i < 10; ++i) writer.write(TruthImages(64, 48, 0.1 * i).at(i));
          writer.end(true);
        },
        OutputError);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(TruthHdf5, WrongImageSizeIsAnInternalError) {
  const TemporaryDirectory directory;
  TruthHdf5Writer writer(directory.path() / "truth.h5", 0);
  writer.begin(test::recording_info(8, 6, 0, kNsPerSecond));
  EXPECT_THROW(writer.write(TruthImages(6, 8, 0).at(0)), InternalError);
}

TEST(PosesTum, LinesParseBack) {
  const TemporaryDirectory directory;
  const auto path = directory.path() / "poses.txt";
  PosesTumWriter writer(path);
  writer.begin(test::recording_info(8, 6, 0, kNsPerSecond));
  for (int i = 0; i < 20; ++i) writer.write(PoseRecord{i * 1'000'001 - 3, some_pose(0.3 * i)});
  writer.end(true);

  const auto lines = test::lines(path);
  ASSERT_EQ(lines.size(), 21u);
  EXPECT_EQ(lines[0], "# timestamp tx ty tz qx qy qz qw");
  EXPECT_EQ(lines[1].substr(0, 12), "-0.000000003");
  for (int i = 0; i < 20; ++i) {
    std::istringstream line(lines[static_cast<std::size_t>(i) + 1]);
    double t = 0, v[7];
    line >> t;
    for (double& value : v) line >> value;
    ASSERT_TRUE(line && line.eof());
    const SE3 expected = some_pose(0.3 * i);
    EXPECT_NEAR(t, to_seconds(i * 1'000'001 - 3), 1e-15);
    EXPECT_LT((Eigen::Vector3d(v[0], v[1], v[2]) - expected.translation).norm(), 1e-11);
    EXPECT_LT((Eigen::Vector4d(v[3], v[4], v[5], v[6]) - expected.rotation.coeffs()).norm(), 1e-11);
  }
}

TEST(ImagesPng, SrgbIsTheNearestLevel) {
  Image<float> linear(1, 3000);
  for (int i = 0; i < linear.height(); ++i) linear(0, i) = static_cast<float>(i) / 2999.0f;
  const auto encoded = encode_srgb(linear);
  for (int i = 0; i < linear.height(); ++i) {
    const double e = linear(0, i);
    const double exact = 255 * (e <= 0.0031308 ? 12.92 * e : 1.055 * std::pow(e, 1 / 2.4) - 0.055);
    ASSERT_LE(std::abs(encoded(0, i) - exact), 0.5001) << e;
  }
  Image<float> odd(1, 4);
  odd(0, 0) = -1;
  odd(0, 1) = std::numeric_limits<float>::quiet_NaN();
  odd(0, 2) = std::numeric_limits<float>::infinity();
  odd(0, 3) = 100;
  const auto clipped = encode_srgb(odd);
  EXPECT_EQ(clipped(0, 0), 0);
  EXPECT_EQ(clipped(0, 1), 0);
  EXPECT_EQ(clipped(0, 2), 255);
  EXPECT_EQ(clipped(0, 3), 255);
}

TEST(ImagesPng, FilesAndTimestamps) {
  const TemporaryDirectory directory;
  const auto folder = directory.path() / "cam0" / "images";
  ImagesPngWriter writer(folder, 0);
  writer.begin(test::recording_info(20, 10, 0, kNsPerSecond));
  const TruthImages first(20, 10, 0), second(20, 10, 0.5);
  writer.write(first.at(0));
  writer.write(second.at(500'000'000));
  writer.end(true);
  EXPECT_EQ(test::lines(folder / "timestamps.txt"),
            (std::vector<std::string>{"# index t_s file", "0 0.000000000 000000.png", "1 0.500000000 000001.png"}));
  const cv::Mat image = cv::imread((folder / "000001.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(image.type(), CV_8UC1);
  ASSERT_EQ(image.size(), cv::Size(20, 10));
  const auto expected = encode_srgb(second.irradiance);
  EXPECT_TRUE(std::equal(image.begin<std::uint8_t>(), image.end<std::uint8_t>(), expected.data()));
}

// --- colour frames --------------------------------------------------------------------------------------------------

/// Decodes the mosaic of uniform irradiance.
template <typename T>
cv::Mat demosaicked(int width, int height, const std::array<T, 3>& light) {
  Image<T> mosaic(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) mosaic(x, y) = light[static_cast<std::size_t>(x % 2 + y % 2)];
  }
  const TemporaryDirectory folder;
  write_demosaicked_png(folder.path() / "a.png", mosaic);
  return cv::imread((folder.path() / "a.png").string(), cv::IMREAD_UNCHANGED);
}

TEST(DemosaickedPng, GivesEveryPixelTheColoursOfUniformLight) {
  for (const auto& [width, height] : {std::pair(16, 12), {7, 5}, {3, 2}, {2, 2}}) {
    const cv::Mat narrow = demosaicked<std::uint8_t>(width, height, {200, 90, 30});
    const cv::Mat wide = demosaicked<std::uint16_t>(width, height, {50'000, 9'000, 300});
    ASSERT_EQ(narrow.type(), CV_8UC3);
    ASSERT_EQ(wide.type(), CV_16UC3);
    ASSERT_EQ(narrow.size(), cv::Size(width, height));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {  // OpenCV stores blue first
        ASSERT_EQ(narrow.at<cv::Vec3b>(y, x), cv::Vec3b(30, 90, 200)) << x << ", " << y << " of " << width;
        ASSERT_EQ(wide.at<cv::Vec3w>(y, x), cv::Vec3w(300, 9'000, 50'000)) << x << ", " << y << " of " << width;
      }
    }
  }
}

TEST(DemosaickedPng, KeepsWhatEachPixelSaw) {
  Image<std::uint8_t> mosaic(12, 10);
  for (std::size_t i = 0; i < mosaic.size(); ++i) mosaic.data()[i] = static_cast<std::uint8_t>(i * 37);
  const TemporaryDirectory folder;
  write_demosaicked_png(folder.path() / "a.png", mosaic);
  const cv::Mat image = cv::imread((folder.path() / "a.png").string(), cv::IMREAD_UNCHANGED);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 12; ++x)
      ASSERT_EQ(image.at<cv::Vec3b>(y, x)[2 - x % 2 - y % 2], mosaic(x, y)) << x << ", " << y;
  }
}

// Logs its calls.
class Probe final : public Sink {
 public:
  Probe(std::string& log, bool fails) : log_(log), fails_(fails) {}
  void begin(const RecordingInfo&) override { log_ += "b"; }
  void write(const Record&) override { log_ += "w"; }
  void end(bool complete) override {
    log_ += complete ? "E" : "e";
    if (fails_) throw OutputError("full");
  }

 private:
  std::string& log_;
  bool fails_;
};

TEST(FanOut, EverySinkIsEnded) {
  std::string log;
  FanOut fan_out;
  fan_out.add(std::make_unique<Probe>(log, true));
  fan_out.add(std::make_unique<Probe>(log, false));
  fan_out.begin({});
  fan_out.write(PoseRecord{});
  EXPECT_THROW(fan_out.end(false), OutputError);
  EXPECT_EQ(log, "bbwwee");
}

}  // namespace
}  // namespace esim
