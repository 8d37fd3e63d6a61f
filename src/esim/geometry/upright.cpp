#include "esim/geometry/upright.h"

#include <fmt/format.h>

#include "esim/core/error.h"

namespace esim::inline geometry {

Eigen::Quaterniond upright(const Eigen::Vector3d& up) {
  const double length = up.stableNorm();
  if (!up.allFinite() || !(length > 0)) {
    throw UserError(
        fmt::format("up must be a direction, such as [0, -1, 0], not [{}, {}, {}]", up.x(), up.y(), up.z()));
  }
  const Eigen::Vector3d u = (up / up.cwiseAbs().maxCoeff()).normalized();
  // The quaternion is proportional to (1 + cos, up × z). Without cancellation, 1 + z = (x² + y²) / (1 - z).
  const double horizontal = u.x() * u.x() + u.y() * u.y();
  if (u.z() < 0 && horizontal == 0) return {0, 1, 0, 0};
  const double w = u.z() < 0 ? horizontal / (1 - u.z()) : 1 + u.z();
  Eigen::Quaterniond rotation(w, u.y(), -u.x(), 0);
  rotation.coeffs().stableNormalize();
  return rotation;
}

}  // namespace esim::inline geometry
