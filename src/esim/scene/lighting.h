#pragma once

#include <Eigen/Core>
#include <vector>

namespace esim::inline scene {

/// Parallel light. A white surface perpendicular to it gets the radiance `strength`.
struct SunLight {
  Eigen::Vector3f direction = -Eigen::Vector3f::UnitZ();  ///< of the light, world frame; any length except zero
  float strength = 1;
};

/// Light from a point, the same in all directions. A white surface perpendicular to it at a distance of r metres gets
/// the radiance strength / r².
struct PointLight {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world frame, m
  float strength = 1;
};

/// The lights of a scene with diffuse (Lambertian) surfaces. A surface with base colour a and the unit normal n on the
/// visible side has the radiance
///     a (ambient + sum over lights of strength_i max(0, <n, l_i>) visible_i) + emission,
/// where l_i is the direction to the light. All values are linear: 1.0 = diffuse white, with no upper limit.
struct Lighting {
  float ambient = 0;
  std::vector<SunLight> suns;
  std::vector<PointLight> points;
  bool shadows = false;  ///< visible_i is 0 where a surface blocks the light; otherwise it is 1 everywhere
};

}  // namespace esim::inline scene
