#include "esim/scenario/conversion.h"

#include "esim/scenario/yaml/yaml_reader.h"

namespace esim::inline scenario {

EventCameraOptions read_event_camera(const std::vector<std::string>& overrides, const std::string& setter) {
  const std::string prefix = "event_camera.";
  YAML::Node root(YAML::NodeType::Map);
  YamlSource source;
  source.setter = setter;
  for (const std::string& text : overrides) {
    source.changed.push_back(apply_override(root, text.starts_with(prefix) ? text : prefix + text, setter));
  }
  EventCameraOptions options;
  YamlReader reader(root, "", source);
  reader("event_camera", options, About{});
  reader.finish();
  return options;
}

}  // namespace esim::inline scenario
