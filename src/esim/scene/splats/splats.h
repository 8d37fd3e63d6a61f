#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <string>
#include <vector>

namespace esim::inline scene {

/// How splats were widened in the image while the model was trained, and how they are widened when it is rendered. The
/// variances are those of gsplat (0.3 px²) and of Mip-Splatting (0.1 px²).
enum class SplatFilter {
  dilated,      ///< by 0.3 px² with unchanged opacity, as by the original 3D Gaussian splatting
  antialiased,  ///< by 0.3 px², and the opacity falls as the splat grows
  mip,          ///< by 0.1 px², and the opacity falls as the splat grows
};

/// The colours of splats.
enum class SplatLight {
  display,  ///< sRGB, 1 = white of a display: models that are trained on photographs
  linear,   ///< linear light
};

/// How splats are projected to the image.
enum class SplatProjection {
  automatic,  ///< linear without distortion, otherwise unscented
  linear,     ///< by the Jacobian of the pinhole at the splat's centre (EWA), as the original 3D Gaussian splatting
  unscented,  ///< by seven points of the splat, which are projected exactly through the lens, as in 3DGUT
};

/// The order in which splats are blended.
enum class SplatOrder {
  distance,  ///< of their centres from the camera: it stays the same when the camera turns
  depth,     ///< of their centres, as the original 3D Gaussian splatting
  ray,       ///< in each pixel, by the depth at which a splat contributes most to it, and by the distance of the
             ///< centres where these depths are equal; on the processor only
};

inline constexpr float kHarmonic0 = 0.28209479177387814F;  ///< Y of degree 0: sqrt(1 / 4π)

/// A scene of three-dimensional Gaussians. All arrays have an entry per splat.
struct Splats {
  std::vector<Eigen::Vector3f> positions;   ///< of their centres, m
  std::vector<Eigen::Vector3f> deviations;  ///< standard deviations along their own axes, m, not negative
  std::vector<Eigen::Vector4f> rotations;   ///< unit quaternions x y z w, from their own axes to the scene's
  std::vector<float> opacities;             ///< at their centres, from 0 to 1

  /// Degree of the spherical harmonics, 0 to 3.
  int degree = 0;

  /// (degree + 1)² coefficients per splat of red, green and blue:
  /// harmonics[(splat * (degree + 1)² + coefficient) * 3 + colour]. The colour seen in the direction d, from the camera
  /// to the splat, is max(0, 0.5 + Σ_k harmonics_k Y_k(d)).
  std::vector<float> harmonics;

  /// From the coordinates of all this to those of the object or the world.
  Eigen::Quaterniond to_object = Eigen::Quaterniond::Identity();

  SplatFilter filter = SplatFilter::dilated;  ///< as the file says
  SplatLight light = SplatLight::display;     ///< as the file says

  std::size_t size() const { return positions.size(); }
  std::size_t coefficients() const { return static_cast<std::size_t>((degree + 1) * (degree + 1)); }
};

/// The area of a splat's outline from the side where it is largest, up to a factor; m².
double largest_area(const Eigen::Vector3d& deviations);

/// The box around the centres, in the object's coordinates.
Eigen::AlignedBox3d bounds(const Splats& splats);

/// The share of the splats, weighted by opacity and area, with a colour at the display's white: 0.98 or above. The
/// light there was brighter by an unknown factor. 0 for SplatLight::linear.
double share_at_white(const Splats& splats);

/// A summary in one line: number, degree, light, filter, and size.
std::string summary(const Splats& splats);

}  // namespace esim::inline scene
