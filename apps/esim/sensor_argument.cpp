#include "sensor_argument.h"

#include <filesystem>

#include "esim/scenario/conversion.h"
#include "esim/scenario/read.h"

namespace esim::app {

EventCameraOptions sensor_of(const std::string& argument, const std::vector<std::string>& overrides) {
  if (!std::filesystem::exists(argument)) {
    std::vector<std::string> options{"preset=" + argument};
    options.insert(options.end(), overrides.begin(), overrides.end());
    return read_event_camera(options);
  }
  ScenarioText text;
  for (const std::string& override : overrides) text.overrides.push_back("event_camera." + override);
  text.needs_renderer = text.needs_trajectory = text.needs_waypoints = false;
  const Scenario scenario = read_scenario(argument, text);
  return in_light_of(scenario, scenario.cameras.front().first_sensor());
}

}  // namespace esim::app
