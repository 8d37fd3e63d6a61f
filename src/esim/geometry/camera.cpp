#include "esim/geometry/camera.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "esim/core/error.h"
#include "esim/geometry/distortion.h"

namespace esim::inline geometry {

namespace {

using Parameters = std::vector<std::pair<const char*, double>>;

Parameters parameters(const NoDistortion&) { return {}; }
Parameters parameters(const RadialTangential& m) {
  return {{"k1", m.k1}, {"k2", m.k2}, {"p1", m.p1}, {"p2", m.p2}, {"k3", m.k3}};
}
Parameters parameters(const Equidistant& m) { return {{"k1", m.k1}, {"k2", m.k2}, {"k3", m.k3}, {"k4", m.k4}}; }
Parameters parameters(const Fov& m) { return {{"w", m.w}}; }

void require_size(int width, int height) {
  if (width <= 0 || height <= 0) {
    throw UserError(fmt::format("camera: the size is {} x {} px; width and height must be positive", width, height));
  }
}

void require_finite(const Parameters& values) {
  for (const auto& [name, value] : values) {
    if (!std::isfinite(value))
      throw UserError(fmt::format("camera: {} is {}; it must be a finite number", name, value));
  }
}

void require_visible(const Camera& camera, int x, int y) {
  if (camera.back_project({x, y})) return;
  throw UserError(
      fmt::format("camera: the distortion cannot be inverted at pixel ({}, {}); check the order and signs of its "
                  "coefficients, or crop the image",
                  x, y));
}

}  // namespace

Camera Camera::from_fov(int width, int height, double horizontal_fov_rad) {
  require_size(width, height);
  if (!(horizontal_fov_rad > 0.0 && horizontal_fov_rad < std::numbers::pi)) {
    throw UserError(
        fmt::format("camera: the horizontal field of view is {} rad; it must be between 0 and pi", horizontal_fov_rad));
  }
  const double focal_length = 0.5 * width / std::tan(0.5 * horizontal_fov_rad);
  return {width, height, focal_length, focal_length, 0.5 * (width - 1), 0.5 * (height - 1), NoDistortion{}};
}

std::optional<Projection> Camera::project(const Eigen::Vector3d& point_C) const {
  if (!(point_C.z() > 0.0)) return std::nullopt;
  const Eigen::Vector2d ideal = point_C.head<2>() / point_C.z();
  if (!ideal.allFinite()) return std::nullopt;
  const auto distorted = std::visit([&](const auto& model) { return distort(model, ideal); }, distortion);
  if (!distorted) return std::nullopt;

  // pixel = focal · distorted + centre, and ∂ideal/∂point = [1 0 −x; 0 1 −y]/Z.
  const Eigen::Array2d focal(fx, fy);
  Eigen::Matrix<double, 2, 3> ideal_by_point;
  ideal_by_point << Eigen::Matrix2d::Identity(), -ideal;
  ideal_by_point /= point_C.z();
  return Projection{(focal * distorted->point.array()).matrix() + Eigen::Vector2d(cx, cy),
                    focal.matrix().asDiagonal() * distorted->jacobian * ideal_by_point};
}

std::optional<BackProjection> Camera::back_project(const Eigen::Vector2d& pixel) const {
  const Eigen::Array2d focal(fx, fy);
  const Eigen::Vector2d distorted = ((pixel - Eigen::Vector2d(cx, cy)).array() / focal).matrix();
  if (!distorted.allFinite()) return std::nullopt;
  const auto inverse = [&](const auto& model) -> std::optional<BackProjection> {
    const auto ideal = undistort(model, distorted);
    const auto there = ideal ? distort(model, *ideal) : std::nullopt;
    if (!there) return std::nullopt;
    BackProjection result{ideal->homogeneous(), Eigen::Matrix<double, 3, 2>::Zero()};
    result.jacobian.topRows<2>() = there->jacobian.inverse() * focal.inverse().matrix().asDiagonal();
    return result;
  };
  return std::visit(inverse, distortion);
}

void Camera::validate() const {
  require_size(width, height);
  require_finite({{"fx", fx}, {"fy", fy}, {"cx", cx}, {"cy", cy}});
  for (const auto& [name, focal_length] : Parameters{{"fx", fx}, {"fy", fy}}) {
    if (!(focal_length > 0.0))
      throw UserError(fmt::format("camera: {} is {} px; it must be positive", name, focal_length));
  }
  require_finite(std::visit([](const auto& model) { return parameters(model); }, distortion));
  if (const Fov* model = std::get_if<Fov>(&distortion); model && !(model->w > 0.0 && model->w < std::numbers::pi)) {
    throw UserError(
        fmt::format("camera: w is {} rad; it must be between 0 and pi (instead of 0, use no distortion)", model->w));
  }
  // The domains contain the optical axis and have no holes: if the border can be inverted, so can the inside.
  for (int x = 0; x < width; ++x) {
    require_visible(*this, x, 0);
    require_visible(*this, x, height - 1);
  }
  for (int y = 0; y < height; ++y) {
    require_visible(*this, 0, y);
    require_visible(*this, width - 1, y);
  }
}

}  // namespace esim::inline geometry
