#include "esim/scenario/waypoint_file.h"

#include <fmt/format.h>

#include "esim/scenario/yaml/yaml_reader.h"

namespace esim::inline scenario {

std::vector<WaypointPointOptions> read_waypoints(const std::filesystem::path& file) {
  const YAML::Node root = parse_yaml(text_of(file, "file of waypoints"), file);
  if (!root.IsMap() || !root["points"].IsDefined()) {
    throw UserError(
        fmt::format("{}: has no waypoints; it must begin with points: and list maps like "
                    "{{position: [0, 0, 1], look_at: [2, 0, 1]}}",
                    file.string()));
  }
  std::vector<WaypointPointOptions> points;
  const YamlSource source{file, {}, kSetter, true};
  YamlReader reader(root, "", source);
  reader("points", points, About{});
  reader.finish();
  return points;
}

}  // namespace esim::inline scenario
