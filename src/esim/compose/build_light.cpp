#include <fmt/format.h>

#include <algorithm>

#include "esim/compose/compose.h"

namespace esim::inline compose {
namespace {

/// Errors of brightness are this fraction of the smallest threshold.
constexpr double kTolerance = 1e-3;

LightAccuracy accuracy_for(const EventCameraOptions& sensor) {
  const bool linear_toe = sensor.response == PixelResponse::lin_log && !sensor.circuit;
  return {kTolerance * sensor.min_threshold(), linear_toe ? sensor.lin_log_knee : sensor.dark_light()};
}

/// Makes each object, or sprite, that flickers a light of its own. `first`: the number of the first one.
template <typename Objects>
void add_sources(const Objects& objects, const char* list, std::size_t first, TimeNs start,
                 const LightAccuracy& accuracy, SceneLight& light) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!objects[i].flicker) continue;
    light.add_source(static_cast<std::uint16_t>(first + i),
                     Modulation(*objects[i].flicker, start, accuracy, fmt::format("renderer.{}.{}.flicker", list, i)));
  }
}

}  // namespace

bool flickers(const Scenario& scenario) {
  const auto has_flicker = [](const auto& objects) {
    return std::ranges::any_of(objects, [](const auto& object) { return object.flicker.has_value(); });
  };
  const auto* const objects = listed_objects(scenario.renderer);
  const auto* const sprites = std::get_if<SpritesRendererOptions>(&scenario.renderer);
  return scenario.light.flicker || (objects != nullptr && has_flicker(*objects)) ||
         (sprites != nullptr && has_flicker(sprites->sprites));
}

LightAccuracy light_accuracy(const CameraOptions& camera) {
  LightAccuracy strictest = accuracy_for(camera.first_sensor());
  for (const SensorOptions& sensor : camera.sensors()) {
    const LightAccuracy accuracy = accuracy_for(sensor);
    strictest.tolerance = std::min(strictest.tolerance, accuracy.tolerance);
    strictest.dark = std::min(strictest.dark, accuracy.dark);
  }
  return strictest;
}

std::optional<Flicker> build_flicker(const Scenario& scenario, const CameraOptions& camera, std::size_t moving,
                                     TimeNs start) {
  const LightAccuracy accuracy = light_accuracy(camera);
  std::optional<Modulation> all;
  if (scenario.light.flicker) all.emplace(*scenario.light.flicker, start, accuracy, "light.flicker");
  SceneLight light(std::move(all));
  if (const auto* const objects = listed_objects(scenario.renderer)) {
    if (moving >= objects->size())  // otherwise, a custom renderer replaces that of the scenario
      add_sources(*objects, "objects", moving - objects->size() + 1, start, accuracy, light);
  }
  if (const auto* const sprites = std::get_if<SpritesRendererOptions>(&scenario.renderer))
    add_sources(sprites->sprites, "sprites", 1, start, accuracy, light);
  if (!light.flickers()) return std::nullopt;
  return Flicker(std::move(light), accuracy.dark);
}

}  // namespace esim::inline compose
