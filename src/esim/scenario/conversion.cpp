#include "esim/scenario/conversion.h"

#include "esim/scenario/yaml_reader.h"

namespace esim::inline scenario {
namespace {

/// The default options with overrides.
template <typename Options>
Options read_overrides(const std::vector<std::string>& overrides, const std::string& setter) {
  YAML::Node root(YAML::NodeType::Map);
  YamlSource source;
  source.setter = setter;
  for (const std::string& text : overrides) source.changed.push_back(apply_override(root, text, setter));
  Options options;
  YamlReader reader(root, "", source);
  describe(reader, options);
  reader.finish();
  return options;
}

struct EventCameraAlone {
  EventCameraOptions event_camera;
};

template <class Visitor>
void describe(Visitor& visit, EventCameraAlone& o) {
  visit("event_camera", o.event_camera, About{});
}

}  // namespace

EventCameraOptions read_event_camera(const std::vector<std::string>& overrides, const std::string& setter) {
  const std::string prefix = "event_camera.";
  std::vector<std::string> prefixed;
  for (const std::string& text : overrides) prefixed.push_back(text.starts_with(prefix) ? text : prefix + text);
  return read_overrides<EventCameraAlone>(prefixed, setter).event_camera;
}

FilterOptions read_filters(const std::vector<std::string>& overrides, const std::string& setter) {
  FilterOptions options = read_overrides<FilterOptions>(overrides, setter);
  validate(options);
  return options;
}

}  // namespace esim::inline scenario
