#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <string>
#include <vector>

#include "esim/scenario/scenario.h"
#include "esim/scenario/yaml/yaml_reader.h"

// Private to scenario: includes yaml-cpp/yaml.h.
namespace esim::inline scenario {

/// Maximum number of event sensors behind one lens.
inline constexpr int kMaxSensors = 256;

/// Reads the event sensors of a scenario's cameras, of which one map can describe several:
///     event_camera: {contrast_threshold: {values: [0.1, 0.2]}}             # two sensors; several such options: a grid
///     event_camera: {count: 4, contrast_threshold: {uniform: [0.1, 0.5]}}  # four, each with its own draw and seed
///     event_cameras: [{name: low, contrast_threshold: 0.1}, {preset: davis346, count: 3}]
class SensorList {
 public:
  /// The seed of the scenario, for draws.
  explicit SensorList(std::uint64_t seed) : seed_(seed) {}

  /// The sensors of the camera whose dotted key is `camera`, from its maps, which may be undefined. Empty if it has
  /// only one, which event_camera describes without variation. Throws OptionError.
  std::vector<SensorOptions> read(const YAML::Node& event_camera, const YAML::Node& event_cameras,
                                  const std::string& camera, const YamlSource& source);

 private:
  void add(const YAML::Node& map, const std::string& key, bool listed, const YamlSource& source,
           std::vector<SensorOptions>& sensors);

  std::uint64_t seed_;
  std::uint16_t distributions_ = 0;  // read so far; each has random numbers of its own
};

}  // namespace esim::inline scenario
