#include "esim/geometry/se3.h"

#include <fmt/format.h>

#include <Eigen/SVD>

#include "esim/core/error.h"

namespace esim::inline geometry {

SE3 SE3::inverse() const {
  const Eigen::Quaterniond back = rotation.conjugate();
  return {back, back * -translation};
}

SE3 SE3::operator*(const SE3& other) const {
  return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

SE3 SE3::from_matrix(const Eigen::Matrix4d& matrix) {
  constexpr double kTolerance = 1e-3;
  if (!matrix.allFinite()) throw UserError("pose matrix: an element is not a finite number; correct it");
  const Eigen::RowVector4d last = matrix.row(3);
  if (!last.isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-9)) {
    throw UserError(fmt::format("pose matrix: the last row is [{} {} {} {}]; it must be [0 0 0 1] (row-major, 4x4)",
                                last[0], last[1], last[2], last[3]));
  }
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const double deviation = (linear.transpose() * linear - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (deviation > kTolerance) {
    throw UserError(fmt::format(
        "pose matrix: the upper left 3x3 block is not a rotation: R^T R differs from the identity by {:.3g} "
        "(tolerance {:g}); give orthonormal columns without scale or shear",
        deviation, kTolerance));
  }
  if (linear.determinant() < 0.0) {
    throw UserError("pose matrix: the upper left 3x3 block is a reflection (determinant -1); flip one axis");
  }
  // The nearest rotation in the Frobenius norm.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()};
}

}  // namespace esim::inline geometry
