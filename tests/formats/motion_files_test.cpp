#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "esim/formats/recording_folder/calibration_files.h"
#include "esim/formats/text/imu_csv.h"
#include "esim/formats/text/states_csv.h"
#include "esim/geometry/so3.h"
#include "formats/recordings.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

/// The numbers of a line of CSV.
std::vector<double> numbers(const std::string& line) {
  std::istringstream fields(line);
  std::vector<double> values;
  for (std::string field; std::getline(fields, field, ',');) values.push_back(std::stod(field));
  return values;
}

std::size_t columns(const std::string& header) {
  return static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1;
}

Kinematics some_motion(double scale) {
  return {{so3_exp(Eigen::Vector3d(0.1, 0.2, scale)), Eigen::Vector3d(1, 2, scale / 3)},
          Eigen::Vector3d(0.1, 0.2, 1 / scale),
          Eigen::Vector3d(-1, -2, scale),
          Eigen::Vector3d(1e-9, scale, 3e8),
          Eigen::Vector3d(4, 5, 6.5)};
}

class MotionFiles : public testing::Test {
 protected:
  std::vector<std::string> lines(const char* name) const { return test::lines(folder_.path() / name); }

  test::TemporaryDirectory folder_;
  RecordingInfo info_ = test::recording_info(8, 6, 0, kNsPerSecond);
};

TEST_F(MotionFiles, ImuMeasurementsAndBiasesReadBackAsTheSameNumbers) {
  info_.imu.emplace();
  ImuCsvWriter writer(folder_.path());
  writer.begin(info_);
  const ImuRecord record{1'000'000'007, {{0.1, 1.0 / 3, -7e-9}, {1, 2, 9.81}}, {{1e-3, 2e-3, 3e-3}, {4, 5, 6.1}}};
  writer.write(record);
  writer.write(PoseRecord{});
  writer.end(true);

  ASSERT_EQ(lines("imu.csv").size(), 2U);
  EXPECT_TRUE(lines("imu.csv")[0].starts_with("#timestamp [ns],w_RS_S_x [rad s^-1],")) << "EuRoC's header";
  EXPECT_TRUE(lines("imu.csv")[1].starts_with("1000000007,"));
  EXPECT_EQ(numbers(lines("imu.csv")[1]), (std::vector<double>{1'000'000'007, 0.1, 1.0 / 3, -7e-9, 1, 2, 9.81}));
  EXPECT_EQ(numbers(lines("imu_truth.csv")[1]), (std::vector<double>{1'000'000'007, 1e-3, 2e-3, 3e-3, 4, 5, 6.1}));
  EXPECT_EQ(columns(lines("imu_truth.csv")[0]), 7U);
}

TEST_F(MotionFiles, StatesHoldPoseTwistAndAccelerations) {
  StatesCsvWriter writer(folder_.path());
  writer.begin(info_);
  const Kinematics motion = some_motion(0.7);
  writer.write(PoseRecord{5, motion});
  writer.end(true);
  const std::vector<double> row = numbers(lines("states.csv")[1]);
  ASSERT_EQ(row.size(), 20U);
  EXPECT_EQ(columns(lines("states.csv")[0]), 20U);
  EXPECT_EQ(row[0], 5);
  EXPECT_EQ(Eigen::Vector3d(&row[1]), motion.T_world_body.translation);
  EXPECT_EQ(Eigen::Vector4d(&row[4]), motion.T_world_body.rotation.coeffs());
  EXPECT_EQ(Eigen::Vector3d(&row[8]), motion.velocity_world);
  EXPECT_EQ(Eigen::Vector3d(&row[11]), motion.omega_body);
  EXPECT_EQ(Eigen::Vector3d(&row[14]), motion.acceleration_world);
  EXPECT_EQ(Eigen::Vector3d(&row[17]), motion.alpha_body);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "objects"));
}

TEST_F(MotionFiles, StatesHoldBiasesAndObjectsWhereThereAreSome) {
  info_.imu.emplace();
  info_.objects = {"ball", "../ball", "ball", ".._ball"};
  StatesCsvWriter writer(folder_.path());
  writer.begin(info_);
  const PoseRecord pose{7,
                        some_motion(0.7),
                        {some_motion(1), some_motion(2), some_motion(3), some_motion(4)},
                        InertialSignals{{1, 2, 3}, {4, 5, 6}}};
  writer.write(pose);
  writer.end(true);
  const std::vector<double> row = numbers(lines("states.csv")[1]);
  EXPECT_EQ(columns(lines("states.csv")[0]), 26U);
  EXPECT_EQ(std::vector<double>(row.end() - 6, row.end()), (std::vector<double>{1, 2, 3, 4, 5, 6}));
  const char* const files[] = {"objects/ball.csv", "objects/.._ball.csv", "objects/ball_2.csv",
                               "objects/.._ball_2.csv"};
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(lines(files[i]).size(), 2U) << files[i];
    EXPECT_EQ(Eigen::Vector3d(&numbers(lines(files[i])[1])[8]), pose.objects[i].velocity_world);
  }
}

TEST_F(MotionFiles, WithoutAnImuThereIsNoImuCalibration) {
  CalibrationWriter writer(folder_.path() / "calibration");
  writer.begin(info_);
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "calibration/camchain.yaml"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "calibration/imu.yaml"));
  EXPECT_EQ(kalibr_camchain(info_).find("T_cam_imu"), std::string::npos);
}

}  // namespace
}  // namespace esim
