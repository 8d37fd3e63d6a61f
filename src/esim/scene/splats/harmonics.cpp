#include "esim/scene/splats/harmonics.h"

#include <Eigen/LU>
#include <cmath>

namespace esim::inline scene {
namespace {

using Values = Eigen::Matrix<double, kMaxSplatCoefficients, 1>;

/// The spherical harmonics of degrees 0 to 3 in a direction, that of degree 0 as 1. The order and signs are those of
/// the original 3D Gaussian splatting.
Values harmonics(const Eigen::Vector3d& d) {
  const double x = d.x(), y = d.y(), z = d.z(), xx = x * x, yy = y * y, zz = z * z;
  Values values;
  values << 1, -0.4886025119029199 * y, 0.4886025119029199 * z, -0.4886025119029199 * x, 1.0925484305920792 * x * y,
      -1.0925484305920792 * y * z, 0.31539156525252005 * (2 * zz - xx - yy), -1.0925484305920792 * x * z,
      0.5462742152960396 * (xx - yy), -0.5900435899266435 * y * (3 * xx - yy), 2.890611442640554 * x * y * z,
      -0.4570457994644658 * y * (4 * zz - xx - yy), 0.3731763325901154 * z * (2 * zz - 3 * xx - 3 * yy),
      -0.4570457994644658 * x * (4 * zz - xx - yy), 1.445305721320277 * z * (xx - yy),
      -0.5900435899266435 * x * (xx - 3 * yy);
  return values;
}

/// The matrix M with Y(d)ᵀ M = Y(Rᵀ d)ᵀ for the harmonics of a degree, from their values in as many directions.
template <int kDegree>
Eigen::Matrix<float, 2 * kDegree + 1, 2 * kDegree + 1> rotation_of_degree(const Eigen::Matrix3d& rotation) {
  constexpr int kCount = 2 * kDegree + 1, kFirst = kDegree * kDegree;
  // On a spiral, in general position.
  Eigen::Matrix<double, kCount, kCount> from, to;
  for (int i = 0; i < kCount; ++i) {
    const double z = 0.95 - 1.3 * i / kCount, radius = std::sqrt(1 - z * z), angle = 2.4 * i + 0.3;
    const Eigen::Vector3d d(radius * std::cos(angle), radius * std::sin(angle), z);
    to.row(i) = harmonics(d).segment<kCount>(kFirst).transpose();
    from.row(i) = harmonics(rotation.transpose() * d).segment<kCount>(kFirst).transpose();
  }
  return to.fullPivLu().solve(from).eval().template cast<float>();
}

template <typename Matrix>
void apply_degree(const Matrix& matrix, float* coefficients) {
  constexpr int kCount = Matrix::RowsAtCompileTime;
  Eigen::Map<Eigen::Matrix<float, kCount, 3, Eigen::RowMajor>> map(coefficients);
  map = (matrix * map).eval();
}

}  // namespace

std::array<float, kMaxSplatCoefficients> harmonic_signs(const Eigen::Vector3f& flip) {
  // Each harmonic is even or odd in each of x, y and z: its sign changes as in any one direction.
  const Eigen::Vector3d d(0.36, 0.48, 0.8);
  const Values before = harmonics(d), after = harmonics(d.cwiseProduct(flip.cast<double>()));
  std::array<float, kMaxSplatCoefficients> signs;
  for (std::size_t k = 0; k < signs.size(); ++k)
    signs[k] = before[static_cast<Eigen::Index>(k)] * after[static_cast<Eigen::Index>(k)] < 0 ? -1.0F : 1.0F;
  return signs;
}

HarmonicRotation::HarmonicRotation(const Eigen::Matrix3d& rotation)
    : first_(rotation_of_degree<1>(rotation)),
      second_(rotation_of_degree<2>(rotation)),
      third_(rotation_of_degree<3>(rotation)) {}

void HarmonicRotation::apply(Splat& splat, std::size_t coefficients) const {
  float* const all = splat.harmonics.data();
  if (coefficients > 1) apply_degree(first_, all + 3);
  if (coefficients > 4) apply_degree(second_, all + 12);
  if (coefficients > 9) apply_degree(third_, all + 27);
}

}  // namespace esim::inline scene
