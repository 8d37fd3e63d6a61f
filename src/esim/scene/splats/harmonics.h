#pragma once

#include <Eigen/Core>
#include <array>

#include "esim/scene/splats/splat_list.h"

// Private to scene: transforms of spherical harmonics.
namespace esim::inline scene {

/// The factors of the coefficients of spherical harmonics if axes change their signs: the function of the direction d
/// with the new coefficients is that of `flip` d with the old ones.
std::array<float, kMaxSplatCoefficients> harmonic_signs(const Eigen::Vector3f& flip);

/// Rotates spherical harmonics: the function of the direction d with the new coefficients is that of Rᵀ d with the old
/// ones.
class HarmonicRotation {
 public:
  /// `rotation` must be orthogonal; it may also mirror.
  explicit HarmonicRotation(const Eigen::Matrix3d& rotation);

  /// Rotates the first `coefficients` (a square) of each colour.
  void apply(Splat& splat, std::size_t coefficients) const;

 private:
  Eigen::Matrix3f first_;
  Eigen::Matrix<float, 5, 5> second_;
  Eigen::Matrix<float, 7, 7> third_;
};

}  // namespace esim::inline scene
