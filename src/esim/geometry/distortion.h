#pragma once

#include <Eigen/Core>
#include <optional>

#include "esim/geometry/camera.h"

namespace esim::inline geometry {

/// A distorted image point and its derivative with respect to the ideal one.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

/// The formula of each model, as in camera.h. Empty outside the model's domain.
std::optional<Distorted> distort(const NoDistortion&, const Eigen::Vector2d& ideal);
std::optional<Distorted> distort(const RadialTangential& model, const Eigen::Vector2d& ideal);
std::optional<Distorted> distort(const Equidistant& model, const Eigen::Vector2d& ideal);
std::optional<Distorted> distort(const Fov& model, const Eigen::Vector2d& ideal);

/// The ideal image point that distort() maps to `distorted`; empty if it does not exist.
std::optional<Eigen::Vector2d> undistort(const NoDistortion&, const Eigen::Vector2d& distorted);
std::optional<Eigen::Vector2d> undistort(const RadialTangential& model, const Eigen::Vector2d& distorted);
std::optional<Eigen::Vector2d> undistort(const Equidistant& model, const Eigen::Vector2d& distorted);
std::optional<Eigen::Vector2d> undistort(const Fov& model, const Eigen::Vector2d& distorted);

/// The largest radius along the x axis inside the domain, at most 1000. The domain of a lens is a disc.
double domain_radius(const Distortion& model);

}  // namespace esim::inline geometry
