#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "esim/motion/fit/fit.h"
#include "esim/motion/trajectory_file.h"
#include "support/test_data.h"

namespace esim {
namespace {

struct RealTrajectory {
  std::string name;
  std::string file;
  std::size_t poses;
  TimeNs end;
  // The deviation of the measured poses from a smooth motion (motion-capture noise and glitches).
  double rms_position_m, rms_rotation_rad;

  friend std::ostream& operator<<(std::ostream& out, const RealTrajectory& trajectory) {
    return out << trajectory.file;
  }
};

class RealTrajectories : public testing::TestWithParam<RealTrajectory> {};

INSTANTIATE_TEST_SUITE_P(
    Files, RealTrajectories,
    testing::Values(RealTrajectory{"poster_6dof", "trajectory/poster_6dof.csv", 11610, 59'830'544'472, 1.2e-3, 8e-3},
                    RealTrajectory{"quadrotor", "trajectory/quadrotor_circles.csv", 4999, 24'990'189'314, 5e-5, 1.5e-3},
                    RealTrajectory{"flying_room", "mesh/flying_room/camera_trajectory.csv", 101, 1'000'000'000, 1e-6,
                                   2e-6},
                    RealTrajectory{"football", "mesh/football/americanfootball.csv", 101, 1'000'000'000, 1e-6, 2e-6}),
    [](const auto& instance) { return instance.param.name; });

TEST_P(RealTrajectories, AreReadAndFitted) {
  const auto path = test::test_data(GetParam().file);
  if (!path) GTEST_SKIP() << "needs " << GetParam().file << " below the directory that ESIM_TEST_DATA names";
  const auto poses = read_trajectory(*path);
  ASSERT_EQ(poses.size(), GetParam().poses);
  EXPECT_EQ(poses.front().t, 0);
  EXPECT_EQ(poses.back().t, GetParam().end);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    ASSERT_GT(poses[i].T_world_body.rotation.dot(poses[i - 1].T_world_body.rotation), 0.9);
  }

  const FittedTrajectory fit = fit_trajectory(poses, {});
  EXPECT_EQ(fit.trajectory.start(), 0);
  EXPECT_EQ(fit.trajectory.end(), GetParam().end);
  EXPECT_LT(fit.report.rms_position_m, GetParam().rms_position_m);
  EXPECT_LT(fit.report.rms_rotation_rad, GetParam().rms_rotation_rad);
  for (TimeNs t = 0; t <= fit.trajectory.end(); t += 5 * kNsPerMs) {
    const Kinematics kinematics = fit.trajectory.at(t);
    ASSERT_LT(kinematics.acceleration_world.norm(), 100.0) << t;
    ASSERT_LT(kinematics.omega_body.norm(), 25.0) << t;
  }
}

}  // namespace
}  // namespace esim
