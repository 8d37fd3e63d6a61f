#include "esim/geometry/upright.h"

#include <gtest/gtest.h>

#include <cmath>

#include "esim/core/error.h"
#include "support/errors.h"

namespace esim {
namespace {

TEST(Upright, TurnsUpToZByTheSmallestRotation) {
  for (const Eigen::Vector3d& up :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0.02, -0.98, 0.17),
        Eigen::Vector3d(3, 4, -5), Eigen::Vector3d(1e-9, 0, -1), Eigen::Vector3d(0, 1e-12, -1),
        Eigen::Vector3d(1e200, 1e200, -1e200), Eigen::Vector3d(-1e-200, 2e-200, -1e-200)}) {
    const Eigen::Quaterniond q = upright(up);
    const Eigen::Vector3d direction = (up / up.cwiseAbs().maxCoeff()).normalized();
    EXPECT_NEAR(q.norm(), 1, 1e-15);
    EXPECT_LT((q * direction - Eigen::Vector3d::UnitZ()).norm(), 1e-15) << up.transpose();
    const double angle = std::acos(std::min(1.0, std::max(-1.0, direction.z())));
    EXPECT_NEAR(2 * std::atan2(q.vec().norm(), q.w()), angle, 1e-7) << up.transpose();
    EXPECT_EQ(q.z(), 0);  // about a horizontal axis
  }
  EXPECT_EQ(upright({0, 0, 5}).coeffs(), Eigen::Vector4d(0, 0, 0, 1));
  EXPECT_EQ(upright({0, 0, -5}).coeffs(), Eigen::Vector4d(1, 0, 0, 0));  // a half turn about x
}

TEST(Upright, RefusesWhatIsNotADirection) {
  const auto message = [](const Eigen::Vector3d& up) { return test::message_of<UserError>([&] { upright(up); }); };
  EXPECT_EQ(message({0, 0, 0}), "up must be a direction, such as [0, -1, 0], not [0, 0, 0]");
  EXPECT_TRUE(test::contains(message({0, std::nan(""), 1}), "up must be a direction"));
  EXPECT_TRUE(test::contains(message({HUGE_VAL, 0, 1}), "up must be a direction"));
}

}  // namespace
}  // namespace esim
