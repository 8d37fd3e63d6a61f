#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/describe.h"

/// The lights of a scene of surfaces.
namespace esim::inline scenario {

/// A factor on a light's strength over time: pairs of time and factor.
using CurveOptions = std::vector<Eigen::Vector2d>;

inline constexpr About kAboutCurve{
    "factor on the strength over time: a list of [time in s, factor], linear in between, constant before the first and "
    "after the last; times as in the trajectory (default: constant)"};
inline constexpr About kAboutCarrier{
    "name of the moving object that carries the light: then its position and direction are in the object's frame "
    "(default: none)"};

struct SunOptions {
  Eigen::Vector3d direction = {0, 0, -1};
  double strength = 1.0;
  CurveOptions curve{};
};

template <class Visitor>
void describe(Visitor& visit, SunOptions& o) {
  visit("direction", o.direction, About{"direction in which the light travels, world frame"});
  visit("strength", o.strength, About{"irradiance of a white surface that faces the sun", "", 0, 1e6});
  visit("curve", o.curve, kAboutCurve);
}

struct PointLightOptions {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double strength = 1.0;
  CurveOptions curve{};
  std::string object{};
};

template <class Visitor>
void describe(Visitor& visit, PointLightOptions& o) {
  visit("position", o.position, About{"position, world frame", "m"});
  visit("strength", o.strength,
        About{"irradiance of a white surface that faces the light at a distance of 1 m", "", 0, 1e9});
  visit("curve", o.curve, kAboutCurve);
  visit("object", o.object, kAboutCarrier);
}

struct AreaLightOptions {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = {0, 0, -1};
  Eigen::Vector2d size = {1, 1};
  double rotation_deg = 0;
  double strength = 1.0;
  int samples = 16;
  CurveOptions curve{};
  std::string object{};
};

template <class Visitor>
void describe(Visitor& visit, AreaLightOptions& o) {
  visit("position", o.position, About{"centre of the rectangle, world frame", "m"});
  visit("direction", o.direction, About{"direction in which it shines, perpendicular to it; its back is dark"});
  visit("size", o.size, About{"width, which is horizontal, and height", "m"});
  visit("rotation_deg", o.rotation_deg, About{"rotates the rectangle around its direction", "deg"});
  visit("strength", o.strength,
        About{"irradiance of a white surface that faces the light from afar, times the squared distance in m", "", 0,
              1e9});
  visit("samples", o.samples,
        About{"number of points of the rectangle at which it is evaluated, a square number: more for smoother shadows "
              "and for smoother surfaces",
              "", 1, 4096});
  visit("curve", o.curve, kAboutCurve);
  visit("object", o.object, kAboutCarrier);
}

/// Light from infinity.
struct EnvironmentOptions {
  std::filesystem::path image;
  double strength = 1.0;
  double rotation_deg = 0;
  bool visible = true;
};

template <class Visitor>
void describe(Visitor& visit, EnvironmentOptions& o) {
  visit("image", o.image,
        About{"equirectangular image, twice as wide as high: .hdr or .exr, or any other that esim reads; its centre is "
              "towards +x"});
  visit("strength", o.strength, About{"factor on its light", "", 0, 1e6});
  visit("rotation_deg", o.rotation_deg, About{"rotates it around z, counterclockwise seen from above", "deg"});
  visit("visible", o.visible, About{"whether cameras see it behind the surfaces, instead of the background"});
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

/// Surfaces that shine, under lights and an environment.
struct PbrOptions {
  static constexpr const char* kType = "pbr";
  std::optional<double> ambient;
  std::vector<SunOptions> suns;
  std::vector<PointLightOptions> points;
  std::vector<AreaLightOptions> areas;
  std::optional<EnvironmentOptions> environment;
  bool shadows = false;
};

template <class Visitor>
void describe(Visitor& visit, PbrOptions& o) {
  visit("ambient", o.ambient,
        About{"light from all directions: irradiance of a white surface that no other light reaches (default: 0.3, and "
              "0 with an environment)",
              "", 0, 1e6});
  visit("suns", o.suns, About{"directional lights: a list of maps of"});
  visit("points", o.points, About{"point lights, whose irradiance falls with the squared distance: a list of maps of"});
  visit("areas", o.areas, About{"rectangles that shine: a list of maps of"});
  visit("environment", o.environment, About{"light from all directions at infinity, by an image (default: none)"});
  visit("shadows", o.shadows, About{"whether surfaces cast shadows in the light of suns, points and areas"});
}

using LightingOptions = std::variant<UnlitOptions, LambertOptions, PbrOptions>;

}  // namespace esim::inline scenario
