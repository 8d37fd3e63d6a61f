#include "esim/compose/load_lighting.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "esim/core/error.h"
#include "esim/scenario/pose_options.h"
#include "esim/scene/environment/environment.h"

namespace esim::inline compose {
namespace {

/// The name of an option in messages.
std::string key_of(const char* list, std::size_t index) { return fmt::format("renderer.lighting.{}.{}", list, index); }

StrengthCurve curve_of(const CurveOptions& options, const std::string& key) {
  StrengthCurve curve;
  for (std::size_t i = 0; i < options.size(); ++i) {
    const double t_s = options[i][0], factor = options[i][1];
    if (!std::isfinite(t_s) || !(factor >= 0) || factor > 1e6) {
      throw UserError(fmt::format("{}.curve.{}: must be [time in s, factor], with a factor from 0 to 1e6, not [{}, {}]",
                                  key, i, t_s, factor));
    }
    if (i > 0 && t_s < options[i - 1][0]) {
      throw UserError(
          fmt::format("{}.curve.{}: its time must not be before that of the previous point, {} s, but is "
                      "{} s; list the points in order of time",
                      key, i, options[i - 1][0], t_s));
    }
    curve.points.push_back({t_s, static_cast<float>(factor)});
  }
  return curve;
}

/// The number of a moving object; none for an empty name.
std::optional<std::size_t> carrier_of(const std::string& name, const Scene& scene, const std::string& key) {
  if (name.empty()) return std::nullopt;
  std::size_t moving = 0;
  std::string names;
  for (const SceneObject& object : scene.objects) {
    if (!object.moves) continue;
    if (object.name == name) {
      if (object.splats == nullptr) return moving;
      throw UserError(
          fmt::format("{}.object: {} consists of splats, which cannot carry a light; name a mesh", key, name));
    }
    names += (names.empty() ? "" : ", ") + object.name;
    ++moving;
  }
  throw UserError(fmt::format("{}.object: the scene has no moving object {}; {}", key, name,
                              names.empty() ? "it has none at all" : "it has " + names));
}

Eigen::Vector3d unit(const Eigen::Vector3d& direction, const std::string& key) {
  if (!(direction.norm() > 1e-6))
    throw UserError(fmt::format("{}: direction must not be [0, 0, 0]; [0, 0, -1] shines straight down", key));
  return direction.normalized();
}

void add_suns(const std::vector<SunOptions>& suns, Lighting& lighting) {
  for (std::size_t i = 0; i < suns.size(); ++i) {
    if (!(suns[i].direction.norm() > 1e-6))
      throw UserError("renderer.lighting.suns: direction must not be [0, 0, 0]; [0, 0, -1] shines straight down");
    lighting.suns.push_back({suns[i].direction.cast<float>(), static_cast<float>(suns[i].strength),
                             curve_of(suns[i].curve, key_of("suns", i))});
  }
}

void add_points(const std::vector<PointLightOptions>& points, const Scene& scene, Lighting& lighting) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string key = key_of("points", i);
    lighting.points.push_back({points[i].position.cast<float>(), static_cast<float>(points[i].strength),
                               curve_of(points[i].curve, key), carrier_of(points[i].object, scene, key)});
  }
}

AreaLight area_of(const AreaLightOptions& options, const Scene& scene, const std::string& key) {
  if (!(options.size.minCoeff() > 0) || !options.size.allFinite() || options.size.maxCoeff() > 1e6) {
    throw UserError(
        fmt::format("{}.size: width and height must be above 0 and at most 1e6 m, not [{}, {}]; a light "
                    "without a size is one of points",
                    key, options.size.x(), options.size.y()));
  }
  const int side = static_cast<int>(std::lround(std::sqrt(options.samples)));
  if (side * side != options.samples) {
    throw UserError(
        fmt::format("{}.samples: must be a square number, not {}; use {}", key, options.samples, side * side));
  }
  const Eigen::Vector3d direction = unit(options.direction, key);
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(options.rotation_deg * std::numbers::pi / 180, direction) * looking_along(direction))
          .toRotationMatrix();
  AreaLight area;
  area.position = options.position.cast<float>();
  area.half_u = (0.5 * options.size.x() * R.col(0)).cast<float>();
  area.half_v = (0.5 * options.size.y() * R.col(1)).cast<float>();
  area.direction = direction.cast<float>();
  area.strength = static_cast<float>(options.strength);
  area.samples = side;
  area.curve = curve_of(options.curve, key);
  area.object = carrier_of(options.object, scene, key);
  return area;
}

Lighting lighting_of(const LambertOptions& options, const Scene& scene, SceneLook) {
  Lighting lighting;
  lighting.ambient = static_cast<float>(options.ambient);
  add_suns(options.suns, lighting);
  add_points(options.points, scene, lighting);
  lighting.shadows = options.shadows;
  return lighting;
}

Lighting lighting_of(const PbrOptions& options, const Scene& scene, SceneLook look) {
  Lighting lighting;
  lighting.glossy = true;
  lighting.ambient = static_cast<float>(options.ambient.value_or(options.environment ? 0.0 : 0.3));
  add_suns(options.suns, lighting);
  add_points(options.points, scene, lighting);
  for (std::size_t i = 0; i < options.areas.size(); ++i)
    lighting.areas.push_back(area_of(options.areas[i], scene, key_of("areas", i)));
  lighting.shadows = options.shadows;
  if (!options.environment) return lighting;
  const EnvironmentOptions& environment = *options.environment;
  if (environment.image.empty())
    throw UserError("renderer.lighting.environment.image: is missing; name an equirectangular image");
  if (look == SceneLook::coded) return lighting;
  lighting.environment = load_environment(environment.image, static_cast<float>(environment.strength),
                                          environment.rotation_deg * std::numbers::pi / 180, look == SceneLook::colour);
  lighting.environment_visible = environment.visible;
  return lighting;
}

/// Whether any surface looks different from elsewhere.
bool shines(const Scene& scene) {
  const auto is_glossy = [](const Material& material) {
    return material.gloss != nullptr && (material.gloss->metallic > 0 || material.gloss->roughness < 1);
  };
  return std::ranges::any_of(
      scene.objects, [&](const SceneObject& object) { return std::ranges::any_of(object.mesh.materials, is_glossy); });
}

}  // namespace

SurfaceModel surface_model(const LightingOptions& options) {
  return std::holds_alternative<PbrOptions>(options) ? SurfaceModel::glossy : SurfaceModel::matte;
}

std::optional<Lighting> load_lighting(const LightingOptions& options, const Scene& scene, SceneLook look) {
  if (const auto* const lambert = std::get_if<LambertOptions>(&options)) return lighting_of(*lambert, scene, look);
  if (const auto* const pbr = std::get_if<PbrOptions>(&options)) return lighting_of(*pbr, scene, look);
  return std::nullopt;
}

void name_unsampled_light(const Scenario& scenario, const Scene& scene, const Notices& notices) {
  if (!scene.lighting) return;
  const auto carried = [](const auto& light) { return light.object.has_value(); };
  const bool changes = varies(*scene.lighting) || std::ranges::any_of(scene.lighting->points, carried) ||
                       std::ranges::any_of(scene.lighting->areas, carried);
  const bool glossy = scene.lighting->glossy && shines(scene);
  if (!changes && !glossy) return;
  const char* const what = changes && glossy ? "lights that move or change, and highlights"
                           : changes         ? "lights that move or change"
                                             : "highlights and mirrored surroundings";
  for (const CameraOptions& camera : scenario.cameras) {
    if (std::holds_alternative<FlowSampling>(camera.sampling)) {
      notices.warning(fmt::format(
          "camera {}: sampling of type flow follows the motion of surfaces, and does not see {}; events of these may "
          "be late or missing. Use sampling: {{type: adaptive}}",
          camera.name, what));
    } else if (std::holds_alternative<KeyframeSampling>(camera.sampling)) {
      notices.warning(fmt::format(
          "camera {}: sampling of type keyframes moves the images of surfaces, and mixes {} between two keyframes; its "
          "audits measure the error. Use sampling: {{type: adaptive}} for these",
          camera.name, what));
    }
  }
}

}  // namespace esim::inline compose
