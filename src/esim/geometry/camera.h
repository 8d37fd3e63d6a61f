#pragma once

#include <Eigen/Core>
#include <optional>
#include <variant>

namespace esim::inline geometry {

/// The distortion models map the ideal image point x = (X/Z, Y/Z) to the distorted one. r = |x|, θ = atan r.
/// Each is invertible on its domain only; points outside the domain are not projected.

/// The ideal pinhole.
struct NoDistortion {};

/// Brown-Conrady with five coefficients, as in OpenCV ("plumb bob") and Kalibr ("radtan"):
///   x (1 + k1 r² + k2 r⁴ + k3 r⁶) + (2 p1 x y + p2 (r² + 2 x²), p1 (r² + 2 y²) + 2 p2 x y).
/// Domain: the largest disc r < r_max on which 1 + 3 k1 r² + 5 k2 r⁴ + 7 k3 r⁶ > 6.4 r sqrt(p1² + p2²). The left side
/// is the slope of the radial part; with barrel distortion, the image folds back onto itself at r_max. The right side
/// bounds the tangential part: the distortion is the gradient of a potential whose Hessian is then positive definite on
/// a convex set, so that no two points of the domain project to the same pixel.
struct RadialTangential {
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;
};

/// Kannala and Brandt, PAMI 2006, eq. (6) with the factor of θ absorbed in the focal lengths; Kalibr's "equi" and
/// OpenCV's fisheye:   x/r θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸).
/// Domain: θ < π/2, and the polynomial grows strictly from 0 to θ.
struct Equidistant {
  double k1 = 0.0, k2 = 0.0, k3 = 0.0, k4 = 0.0;
};

/// Devernay and Faugeras, "Straight lines have to be straight", 2001, eq. (13), with 0 < w < π rad:
///   x/r atan(2 r tan(w/2)) / w.   Domain: everything in front of the camera.
struct Fov {
  double w = 0.0;
};

using Distortion = std::variant<NoDistortion, RadialTangential, Equidistant, Fov>;

/// The pixel of a point, and its derivative with respect to the point.
struct Projection {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> jacobian;  // px/m: ∂pixel/∂point_C
};

/// The viewing direction of a pixel, and its derivative with respect to the pixel.
struct BackProjection {
  Eigen::Vector3d bearing;               // z = 1; bearing times planar depth is the point in the camera frame
  Eigen::Matrix<double, 3, 2> jacobian;  // 1/px: ∂bearing/∂pixel
};

/// A pinhole with distortion. Camera frame: x right, y down, z forward. Pixel centres are at integer coordinates,
/// so the image spans [-0.5, width - 0.5] × [-0.5, height - 0.5].
struct Camera {
  int width = 0, height = 0;  // px
  double fx = 0.0, fy = 0.0;  // px
  double cx = 0.0, cy = 0.0;  // px
  Distortion distortion;

  /// An ideal camera with square pixels, the principal point in the middle of the image, and a field of view of
  /// horizontal_fov_rad between its left and right borders. Throws UserError unless 0 < horizontal_fov_rad < π and
  /// the size is positive.
  static Camera from_fov(int width, int height, double horizontal_fov_rad);

  /// pixel = (fx x' + cx, fy y' + cy), where x' is the distorted image point. Empty for points that are not in front of
  /// the camera (Z ≤ 0) or outside the distortion's domain; the pixel may be outside the image.
  std::optional<Projection> project(const Eigen::Vector3d& point_C) const;

  /// The inverse of project(), up to rounding. Empty for pixels to which no point in the domain projects.
  std::optional<BackProjection> back_project(const Eigen::Vector2d& pixel) const;

  /// Throws UserError for a size that is not positive, focal lengths that are not positive and finite, other
  /// parameters that are not finite, and a distortion that cannot be inverted at one of the border's pixels.
  void validate() const;
};

}  // namespace esim::inline geometry
