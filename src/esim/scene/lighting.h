#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "esim/core/time.h"
#include "esim/geometry/se3.h"

namespace esim::inline scene {

class Environment;

/// A factor on the strength of a light over time: linear between its points, constant before the first and after the
/// last one. Empty: 1.
struct StrengthCurve {
  struct Point {
    double t_s;
    float factor;
  };
  std::vector<Point> points;  ///< in order of time; at two equal times, it steps

  float at(TimeNs t) const;
};

/// Parallel light. A white surface perpendicular to it gets the radiance `strength`.
struct SunLight {
  Eigen::Vector3f direction = -Eigen::Vector3f::UnitZ();  ///< of the light, world frame; any length except zero
  float strength = 1;
  StrengthCurve curve{};
};

/// Light from a point, the same in all directions. A white surface perpendicular to it at a distance of r metres gets
/// the radiance strength / r².
struct PointLight {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world frame, or frame of `object`, m
  float strength = 1;
  StrengthCurve curve{};
  std::optional<std::size_t> object{};  ///< number of the moving object that carries the light
};

/// Light from one side of a rectangle, equally bright from all directions. A white surface that faces it on its axis at
/// a distance of r metres, much larger than the rectangle, gets the radiance strength / r². It is evaluated at
/// `samples` x `samples` fixed points, each at the centre of an equal part of the rectangle.
struct AreaLight {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();        ///< of its centre; world frame, or frame of `object`, m
  Eigen::Vector3f half_u = 0.5F * Eigen::Vector3f::UnitX();  ///< from the centre to the middle of a side; m
  Eigen::Vector3f half_v = 0.5F * Eigen::Vector3f::UnitY();  ///< to the next side, perpendicular to half_u; m
  Eigen::Vector3f direction = -Eigen::Vector3f::UnitZ();     ///< in which it shines; unit length
  float strength = 1;
  int samples = 4;
  StrengthCurve curve{};
  std::optional<std::size_t> object{};
};

/// The lights of a scene. Surfaces are diffuse (Lambertian), unless `glossy`. A diffuse surface with base colour a and
/// the unit normal n on the visible side has the radiance
///     a (ambient + sum over lights of strength_i max(0, <n, l_i>) visible_i) + emission,
/// where l_i is the direction to the light. All values are linear: 1.0 = diffuse white, with no upper limit.
///
/// Glossy surfaces reflect as in glTF 2.0 (Khronos, "Specification", appendix B), with the parameters of Gloss:
/// docs/methods/shading.md has the equations. `ambient` is then the radiance that arrives from all directions.
struct Lighting {
  float ambient = 0;
  std::vector<SunLight> suns;
  std::vector<PointLight> points;
  bool shadows = false;  ///< visible_i is 0 where a surface blocks the light; otherwise it is 1 everywhere
  bool glossy = false;

  // Only if `glossy`.
  std::vector<AreaLight> areas{};
  std::shared_ptr<const Environment> environment{};  ///< light from infinity; casts no shadows
  bool environment_visible = false;                  ///< it replaces the background
};

/// The lights at a time: strengths with their curves, positions in the world frame. `objects` are the poses
/// T_world_object of the moving objects.
Lighting lighting_at(const Lighting& lighting, TimeNs t, std::span<const SE3> objects);

/// Whether lights change at all while the camera and all objects are at rest.
bool varies(const Lighting& lighting);

}  // namespace esim::inline scene
