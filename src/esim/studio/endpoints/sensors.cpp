#include <fmt/format.h>

#include "esim/compose/samples/sensor_preview.h"
#include "esim/core/error.h"
#include "esim/scenario/read.h"
#include "esim/studio/editor/scenario_values.h"
#include "esim/studio/endpoints/endpoints.h"

namespace esim::studio {
namespace {

/// The key of an option of a sensor, event_camera.*, whichever camera of the scenario it belongs to.
std::string key_of_sensor(const std::string& key) {
  for (const std::string& sensor : {std::string(".event_camera."), std::string(".event_cameras.")}) {
    const std::size_t at = key.find(sensor);
    if (!key.starts_with("cameras.") || at == std::string::npos) continue;
    const std::size_t option = at + sensor.size();
    const std::size_t end = sensor.ends_with("s.") ? key.find('.', option) + 1 : option;  // after the number of a list
    return "event_camera." + key.substr(end);
  }
  return key;
}

/// "KEY=VALUE" for each of [{where, value}].
std::vector<std::string> overrides_in(const Json& request) {
  std::vector<std::string> overrides;
  const auto changes = request.find("changes");
  if (changes == request.end() || !changes->is_array()) throw HttpError(400, "changes: must be a list");
  for (const Json& change : *changes) {
    if (!change.is_object() || !change.contains("value")) throw HttpError(400, "changes: each must be {where, value}");
    overrides.push_back(text_member(change, "where") + "=" + text_of(change["value"]));  // JSON is YAML
  }
  return overrides;
}

/// All options that can be changed, of a sensor of a camera.
Json options_of(const SensorPreview& preview, const std::string& name) {
  const Json all = values_of(write_scenario(preview.scenario()), "scenario.yaml");
  Json values{{"light", all.at("light")}};
  for (const Json& camera : all.at("cameras")) {
    if (camera.at("name") != name) continue;
    if (camera.contains("event_cameras")) values["event_camera"] = camera.at("event_cameras").at(0);
    if (camera.contains("event_camera")) values["event_camera"] = camera.at("event_camera");
  }
  return values;
}

Response change(const Request& request, const Workshop& workshop) {
  const Json body = parse_object(request.body);
  const std::string camera = text_member(body, "camera");
  const auto recording = workshop.recordings.find(request.captured.front());
  SensorPreviewOptions options;
  options.recording = recording->path();
  options.camera = camera;
  if (!recording->view()->camera(camera).samples) {
    throw HttpError(
        404, camera + ": has no samples from which new events could be made; simulate with " + "output.samples=true");
  }
  options.overrides = overrides_in(body);
  options.threads = workshop.threads;
  options.refuses = [&roots = workshop.roots](const std::filesystem::path& file) {
    return roots.contains(file) ? "" : file.string() + " is not in one of the folders that are open";
  };
  try {
    const std::string id = workshop.sensors.add(std::move(options), text_member(body, "replaces", ""));
    const std::shared_ptr<const ChangedSensor> sensor = workshop.sensors.find(id);
    Json answer{{"sensor", id}, {"values", options_of(sensor->preview(), camera.substr(0, camera.find('/')))}};
    if (!sensor->preview().inexact().empty()) answer["inexact"] = sensor->preview().inexact();
    return json_response(answer);
  } catch (const OptionError& error) {
    const std::string key = key_of_sensor(error.key());
    throw OptionError(fmt::format("{}: {}", key, error.problem()), key, error.problem());
  }
}

}  // namespace

void add_sensors(Router& router, const Workshop& workshop) {
  router.add("POST", "/api/recordings/*/sensor",
             [workshop](const Request& request) { return change(request, workshop); });
}

}  // namespace esim::studio
