#include "esim/scenario/yaml/renamed_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <sstream>

namespace esim::inline scenario {
namespace {

/// An option that has another name now. `map` is the dotted key of the map that contains it; "*" stands for every entry
/// of a list.
struct RenamedKey {
  const char *map, *before, *now;
};

// Entries use the present names of maps that are renamed in entries above them.
constexpr std::array kRenamedKeys = {
    RenamedKey{"truth", "flow", "motion_field"},
    RenamedKey{"truth", "displacement", "optical_flow"},
    RenamedKey{"renderer", "layers", "sprites"},
    RenamedKey{"renderer.sprites.*", "keyframes", "poses"},
};

using Path = std::vector<std::string>;

Path parts_of(const std::string& key) {
  Path parts;
  std::istringstream stream(key);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  return parts;
}

std::string joined(const Path& parts) {
  std::string key;
  for (const std::string& part : parts) key += (key.empty() ? "" : ".") + part;
  return key;
}

void notify(const std::string& before, const std::string& now, std::vector<std::string>& notices) {
  const std::string notice = fmt::format("{} is now {}", before, now);
  if (std::ranges::find(notices, notice) == notices.end()) notices.push_back(notice);
}

/// Calls `visit` with every map at the path, and its key.
void visit_maps(const YAML::Node& node, const Path& path, std::size_t depth, const std::string& key,
                const std::function<void(YAML::Node map, const std::string& key)>& visit) {
  const auto child = [&](const std::string& name) { return key.empty() ? name : key + "." + name; };
  if (depth == path.size()) {
    if (node.IsMap()) visit(node, key);
  } else if (path[depth] == "*") {
    for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i)
      visit_maps(node[i], path, depth + 1, child(std::to_string(i)), visit);
  } else if (node.IsMap() && node[path[depth]].IsDefined()) {
    visit_maps(node[path[depth]], path, depth + 1, child(path[depth]), visit);
  }
}

}  // namespace

std::string with_present_names(const std::string& key, std::vector<std::string>& notices) {
  Path parts = parts_of(key);
  bool changed = false;
  for (const RenamedKey& renamed : kRenamedKeys) {
    const Path map = parts_of(renamed.map);
    if (parts.size() <= map.size() || parts[map.size()] != renamed.before) continue;
    const auto same = [](const std::string& pattern, const std::string& part) {
      return pattern == "*" || pattern == part;
    };
    if (!std::equal(map.begin(), map.end(), parts.begin(), same)) continue;
    Path option(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(map.size()) + 1);
    const std::string before = joined(option);
    parts[map.size()] = option.back() = renamed.now;
    notify(before, joined(option), notices);
    changed = true;
  }
  return changed ? joined(parts) : key;
}

void use_present_names(const YAML::Node& root, const YamlSource& source, std::vector<std::string>& notices) {
  for (const RenamedKey& renamed : kRenamedKeys) {
    visit_maps(root, parts_of(renamed.map), 0, "", [&](YAML::Node map, const std::string& key) {
      const YAML::Node value = std::as_const(map)[renamed.before];
      if (!value.IsDefined()) return;
      const std::string before = fmt::format("{}.{}", key, renamed.before),
                        now = fmt::format("{}.{}", key, renamed.now);
      if (std::as_const(map)[renamed.now].IsDefined()) {
        YamlReader::fail(source, value, before,
                         fmt::format("must not be given together with {}, its new name; remove {}", now, before));
      }
      map[renamed.now] = value;
      map.remove(renamed.before);
      notify(before, now, notices);
    });
  }
}

}  // namespace esim::inline scenario
