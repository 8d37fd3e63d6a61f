#include "esim/motion/trajectory_file.h"

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "support/errors.h"
#include "support/numeric.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

using test::contains;

class TrajectoryFile : public testing::Test {
 protected:
  std::vector<TimedPose> read(const std::string& content) const {
    return read_trajectory(directory_.write("trajectory", content));
  }
  std::string error_of(const std::string& content) const {
    return test::message_of<UserError>([&] { read(content); });
  }
  test::TemporaryDirectory directory_;
};

TEST_F(TrajectoryFile, ReadsTum) {
  const auto poses = read("# t x y z qx qy qz qw\n0.5 1 2 3 0.5 -0.5 0.5 0.5\n1.25 -1e-3 +2.5 0 0 0 0 1\n");
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].t, 500'000'000);
  EXPECT_EQ(poses[0].T_world_body.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(poses[0].T_world_body.rotation.coeffs(), Eigen::Vector4d(0.5, -0.5, 0.5, 0.5));
  EXPECT_EQ(poses[1].t, 1'250'000'000);
  EXPECT_EQ(poses[1].T_world_body.translation, Eigen::Vector3d(-1e-3, 2.5, 0));
}

TEST_F(TrajectoryFile, ReadsEsimCsv) {
  const auto poses = read(
      "# timestamp, x, y, z, qx, qy, qz, qw\n"
      "0,4.4,-0.45,1.43,0,0,0,1\n"
      "4999161, 4.5, -0.46, 1.44, 0, 0, 0, 1\n"
      "10000000.000000, 4.6, -0.47, 1.45, 0, 0, 1, 0\n");
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(poses[1].t, 4'999'161);
  EXPECT_EQ(poses[2].t, 10'000'000);
  EXPECT_EQ(poses[2].T_world_body.translation, Eigen::Vector3d(4.6, -0.47, 1.45));
  EXPECT_EQ(poses[2].T_world_body.rotation.coeffs(), Eigen::Vector4d(0, 0, 1, 0));
}

TEST_F(TrajectoryFile, KeepsEveryNanosecond) {
  const std::string rest = " 0 0 0 0 0 0 1\n", csv_rest = ",0,0,0,0,0,0,1\n";
  const auto tum = read("1403715273.262142976" + rest + "1403715273.262142977" + rest + "1.4037152732621429781e+09" +
                        rest + "1403715273.2621429785" + rest);
  EXPECT_EQ(tum[0].t, 1'403'715'273'262'142'976);
  EXPECT_EQ(tum[1].t, 1'403'715'273'262'142'977);
  EXPECT_EQ(tum[2].t, 1'403'715'273'262'142'978);
  EXPECT_EQ(tum[3].t, 1'403'715'273'262'142'979);
  const auto csv = read("1403715273262142976" + csv_rest + "1403715273262142977.0" + csv_rest +
                        "1.403715273262142978e18" + csv_rest + "1403715273262142979.49" + csv_rest);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(csv[i].t, 1'403'715'273'262'142'976 + static_cast<TimeNs>(i));
}

TEST_F(TrajectoryFile, ReadsStampsInEveryDecimalNotation) {
  const std::string rest = " 0 0 0 0 0 0 1\n";
  const auto poses = read("-2" + rest + "-.5" + rest + "-6e-11" + rest + "+.5E0" + rest + "1." + rest + "15e-1" + rest +
                          "0.0000000002e10" + rest);
  const std::vector<TimeNs> expected{-2'000'000'000, -500'000'000, 0, 500'000'000, 1'000'000'000,
                                     1'500'000'000,  2'000'000'000};
  ASSERT_EQ(poses.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(poses[i].t, expected[i]);
}

TEST_F(TrajectoryFile, AcceptsWhatEditorsLeaveBehind) {
  const auto poses = read(
      "\xEF\xBB\xBF# comment\r\n\r\n  \t\r\n0 0 0 0 0 0 0 1  \r\n#0 0\r\n   # indented\r\n\t1\t0 0  0 0 0 0 1\t\r\n\n2 "
      "0 0 0 0 "
      "0 0 1");
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(poses[2].t, 2'000'000'000);
  EXPECT_EQ(read("0, 0, 0, 0, 0, 0, 0, 1 \r\n\r\n5,0,0,0,0,0,0,1\t\r\n").size(), 2u);
}

TEST_F(TrajectoryFile, NormalisesQuaternionsAndKeepsTheirSignsTogether) {
  const auto poses = read("0 0 0 0 0 0 0 2\n1 0 0 0 0 0 -0.1 -1\n2 0 0 0 0 0 0.2 1\n3 0 0 0 0 0 -300 -1000\n");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_NEAR(poses[i].T_world_body.rotation.norm(), 1.0, 1e-15);
    EXPECT_GT(poses[i].T_world_body.rotation.w(), 0.9) << i;
  }
}

TEST_F(TrajectoryFile, AcceptsUnevenStampsUpToALimit) {
  const std::string rest = " 0 0 0 0 0 0 1\n";
  EXPECT_NO_THROW(read("0" + rest + "1" + rest + "1.2" + rest + "3" + rest + "3.5" + rest));
  const std::string even = "0" + rest + "1" + rest + "2" + rest + "3" + rest;
  EXPECT_NO_THROW(read(even + "23" + rest));
  const std::string message = error_of(even + "# a comment\n" + "23.000000001" + rest);
  EXPECT_TRUE(contains(message, "trajectory:6: "));
  EXPECT_TRUE(contains(message, "no pose in the 20 s before this one"));
  EXPECT_TRUE(contains(message, "add poses"));
}

TEST_F(TrajectoryFile, NamesTheLineOfEveryMistake) {
  const std::string first = "# header\n0 0 0 0 0 0 0 1\n\n";
  EXPECT_TRUE(
      contains(error_of(first + "1 0 0 0 0 0 1\n"), "trajectory:4: 7 columns instead of 8; a TUM file has t x y z"));
  EXPECT_TRUE(contains(error_of(first + "1 0 0 0 0 0 0 1 9\n"), "trajectory:4: 9 columns"));
  EXPECT_TRUE(contains(error_of(first + "1\n"), "trajectory:4: 1 column instead"));
  EXPECT_TRUE(contains(error_of(first + "1,0,0,0,0,0,0,1\n"), "trajectory:4: 1 column instead"));
  EXPECT_TRUE(
      contains(error_of("0,0,0,0,0,0,0,1\n1 0 0 0 0 0 0 1\n"), "trajectory:2: 1 column instead of 8; a ESIM CSV"));
  EXPECT_TRUE(contains(error_of("0,0,0,0,0,0,0,1\n1,0,0,0,0,0,0,1,\n"), "trajectory:2: 9 columns"));
  EXPECT_TRUE(contains(error_of(first + "1 0 0 nan 0 0 0 1\n"), "trajectory:4: z is 'nan'"));
  EXPECT_TRUE(contains(error_of(first + "1 -inf 0 0 0 0 0 1\n"), "trajectory:4: x is '-inf'"));
  EXPECT_TRUE(contains(error_of(first + "1 0 0 0 0 0 0 1e999\n"), "trajectory:4: qw is '1e999'"));
  EXPECT_TRUE(contains(error_of(first + "1 0 1x 0 0 0 0 1\n"), "trajectory:4: y is '1x'"));
  EXPECT_TRUE(contains(error_of(first + "1 0 +-1 0 0 0 0 1\n"), "trajectory:4: y is '+-1'"));
  EXPECT_TRUE(contains(error_of("0,0,0,0,0,0,0,1\n1,0,0,0,,0,0,1\n"), "trajectory:2: qx is ''"));
  EXPECT_TRUE(contains(error_of(first + "1 0 0 0 0 0 0 0\n"), "trajectory:4: the quaternion is zero"));
  EXPECT_TRUE(contains(error_of(first + "0.0 0 0 0 0 0 0 1\n"), "trajectory:4: the stamp 0 ns occurs twice"));
  EXPECT_TRUE(
      contains(error_of(first + "-1 0 0 0 0 0 0 1\n"), "trajectory:4: the stamp -1000000000 ns comes after 0 ns"));
}

TEST_F(TrajectoryFile, RefusesStampsThatAreNoDecimalNumberInRange) {
  for (const std::string stamp : {"nan", "inf", "1e", "e5", ".", "-", "+-1", "1.2.3", "0x10", "1e99999999999", "1e10",
                                  "4611686018.427387904", "1e5.0", "1_000", "--1"}) {
    EXPECT_TRUE(
        contains(error_of("0 0 0 0 0 0 0 1\n" + stamp + " 0 0 0 0 0 0 1\n"), "trajectory:2: the stamp '" + stamp + "'"))
        << stamp;
  }
  EXPECT_EQ(read("0 0 0 0 0 0 0 1\n4611686018.427387903 0 0 0 0 0 0 1\n")[1].t, 4'611'686'018'427'387'903);
}

TEST_F(TrajectoryFile, NeedsTwoPoses) {
  EXPECT_TRUE(contains(error_of(""), "trajectory: 0 poses, but"));
  EXPECT_TRUE(contains(error_of("# only a comment\n"), "trajectory: 0 poses, but"));
  EXPECT_TRUE(contains(error_of("0 0 0 0 0 0 0 1\n"), "trajectory: 1 pose, but"));
}

TEST_F(TrajectoryFile, SaysWhyAFileCannotBeRead) {
  const auto error_at = [](const std::filesystem::path& path) {
    return test::message_of<UserError>([&] { read_trajectory(path); });
  };
  EXPECT_TRUE(
      contains(error_at(directory_.path() / "missing.csv"), "missing.csv: cannot open the trajectory: No such file"));
  EXPECT_TRUE(contains(error_at(directory_.path()),
                       "the folder contains neither images.bin nor images.txt nor transforms.json"));
}

}  // namespace
}  // namespace esim
