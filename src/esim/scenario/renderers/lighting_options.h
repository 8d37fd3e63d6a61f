#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "esim/core/describe.h"

/// The lights of a scene of surfaces.
namespace esim::inline scenario {

struct SunOptions {
  Eigen::Vector3d direction = {0, 0, -1};
  double strength = 1.0;
};

template <class Visitor>
void describe(Visitor& visit, SunOptions& o) {
  visit("direction", o.direction, About{"direction in which the light travels, world frame"});
  visit("strength", o.strength, About{"irradiance of a white surface that faces the sun", "", 0, 1e6});
}

struct PointLightOptions {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double strength = 1.0;
};

template <class Visitor>
void describe(Visitor& visit, PointLightOptions& o) {
  visit("position", o.position, About{"position, world frame", "m"});
  visit("strength", o.strength,
        About{"irradiance of a white surface that faces the light at a distance of 1 m", "", 0, 1e9});
}

/// Surfaces show their base colour, independent of lights.
struct UnlitOptions {
  static constexpr const char* kType = "unlit";
};

template <class Visitor>
void describe(Visitor&, UnlitOptions&) {}

/// Diffuse surfaces under lights.
struct LambertOptions {
  static constexpr const char* kType = "lambert";
  double ambient = 0.3;
  std::vector<SunOptions> suns;
  std::vector<PointLightOptions> points;
  bool shadows = false;
};

template <class Visitor>
void describe(Visitor& visit, LambertOptions& o) {
  visit("ambient", o.ambient, About{"irradiance of a white surface that no light reaches", "", 0, 1e6});
  visit("suns", o.suns, About{"directional lights: a list of maps of"});
  visit("points", o.points, About{"point lights, whose irradiance falls with the squared distance: a list of maps of"});
  visit("shadows", o.shadows, About{"whether surfaces cast shadows"});
}

using LightingOptions = std::variant<UnlitOptions, LambertOptions>;

}  // namespace esim::inline scenario
