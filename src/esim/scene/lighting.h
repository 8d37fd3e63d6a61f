#pragma once

#include <Eigen/Core>
#include <vector>

namespace esim {

/// Parallel light. A white surface that it falls on squarely gets the radiance `strength`.
struct SunLight {
  Eigen::Vector3f direction = -Eigen::Vector3f::UnitZ();  ///< in which it shines, world frame; of any length but zero
  float strength = 1;
};

/// Light from a point, the same in all directions. A white surface that it falls on squarely from r metres away gets
/// the radiance strength / r².
struct PointLight {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world frame, m
  float strength = 1;
};

/// The light that falls on a scene's diffuse (Lambertian) surfaces. One of base colour a, with the unit normal n on the
/// side that is seen, shows the radiance
///     a (ambient + sum over lights of strength_i max(0, <n, l_i>) visible_i) + emission,
/// l_i being the direction to the light. Everything is linear: 1.0 = diffuse white, with no upper end.
struct Lighting {
  float ambient = 0;
  std::vector<SunLight> suns;
  std::vector<PointLight> points;
  bool shadows = false;  ///< visible_i is 0 where a surface stands between; 1 everywhere otherwise
};

}  // namespace esim
