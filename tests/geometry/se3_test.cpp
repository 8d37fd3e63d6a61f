#include "esim/geometry/se3.h"

#include <gtest/gtest.h>

#include "esim/core/error.h"
#include "esim/geometry/so3.h"
#include "support/errors.h"
#include "support/numeric.h"

namespace esim {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using test::contains;
using test::largest_difference;

const SE3 kA{so3_exp({0.3, -1.1, 2.0}), {1.0, -2.0, 3.0}};
const SE3 kB{so3_exp({-0.7, 0.2, 0.5}), {-4.0, 0.5, 0.1}};
const SE3 kC{so3_exp({3.0, 0.1, 0.2}), {0.2, 7.0, -1.0}};

double distance(const SE3& a, const SE3& b) { return largest_difference(a.matrix(), b.matrix()); }

std::string error_of(const Matrix4d& matrix) {
  return test::message_of<UserError>([&] { SE3::from_matrix(matrix); });
}

TEST(Se3, DefaultIsTheIdentity) { EXPECT_EQ(SE3().matrix(), Matrix4d::Identity()); }

TEST(Se3, GroupLaws) {
  EXPECT_LT(distance(kA * SE3(), kA), 1e-15);
  EXPECT_LT(distance(SE3() * kA, kA), 1e-15);
  EXPECT_LT(distance(kA * kA.inverse(), SE3()), 1e-15);
  EXPECT_LT(distance(kA.inverse() * kA, SE3()), 1e-15);
  EXPECT_LT(distance((kA * kB) * kC, kA * (kB * kC)), 1e-14);
  EXPECT_LT(distance((kA * kB).inverse(), kB.inverse() * kA.inverse()), 1e-14);
}

TEST(Se3, ActsAsItsMatrix) {
  const Vector3d point(0.4, -5.0, 6.0);
  EXPECT_LT(largest_difference(kA * point, (kA.matrix() * point.homogeneous()).head<3>()), 1e-14);
  EXPECT_LT(largest_difference((kA * kB) * point, kA * (kB * point)), 1e-14);
  EXPECT_LT(largest_difference((kA * kB).matrix(), kA.matrix() * kB.matrix()), 1e-14);
}

TEST(Se3, ManyProductsStayRigid) {
  SE3 product;
  for (int i = 0; i < 100000; ++i) product = product * kB;
  EXPECT_NEAR(product.rotation.norm(), 1.0, 1e-15);
}

TEST(Se3, FromMatrixInvertsMatrix) {
  for (const SE3& pose : {SE3(), kA, kB, kC}) EXPECT_LT(distance(SE3::from_matrix(pose.matrix()), pose), 1e-14);
}

TEST(Se3, FromMatrixRepairsRounding) {
  // Four digits, as in calibration files.
  const Matrix4d rounded = (kA.matrix() * 1e4).array().round().matrix() / 1e4;
  const SE3 pose = SE3::from_matrix(rounded);
  EXPECT_LT(distance(pose, kA), 1e-4);
  EXPECT_NEAR(pose.rotation.norm(), 1.0, 1e-15);
  const Eigen::Matrix3d rotation = pose.matrix().topLeftCorner<3, 3>();
  EXPECT_LT(largest_difference(rotation.transpose() * rotation, Eigen::Matrix3d::Identity()), 1e-14);
}

TEST(Se3, FromMatrixFindsTheNearestRotation) {
  // A rotation times a symmetric positive matrix: its polar decomposition.
  Matrix4d stretched = kA.matrix();
  stretched.topLeftCorner<3, 3>() *= Vector3d(1.0003, 0.9998, 1.0001).asDiagonal();
  EXPECT_LT(distance(SE3::from_matrix(stretched), kA), 1e-14);
}

TEST(Se3, FromMatrixRefusesWhatIsNoRigidMotion) {
  Matrix4d scaled = kA.matrix();
  scaled.topLeftCorner<3, 3>() *= 1.001;
  EXPECT_TRUE(contains(error_of(scaled), "is not a rotation"));

  Matrix4d mirrored = kA.matrix();
  mirrored.col(0) *= -1.0;
  EXPECT_TRUE(contains(error_of(mirrored), "reflection"));

  EXPECT_TRUE(contains(error_of(kA.matrix().transpose()), "last row"));
  EXPECT_TRUE(contains(error_of(Matrix4d::Zero()), "last row"));

  Matrix4d broken = kA.matrix();
  broken(1, 3) = std::nan("");
  EXPECT_TRUE(contains(error_of(broken), "finite"));
}

}  // namespace
}  // namespace esim
