#include "esim/scenario/variation/sensor_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <variant>

#include "esim/core/random.h"
#include "esim/scenario/variation/distribution.h"
#include "esim/scenario/yaml/inherit.h"

namespace esim::inline scenario {
namespace {

constexpr const char* kValues = "values";
constexpr std::uint16_t kSeeds = 0;  // the stream of random numbers for seeds; those of distributions follow

/// The number of sensors that a map describes.
struct Count {
  int count = 1;
};

template <class Visitor>
void describe(Visitor& visit, Count& o) {
  visit("count", o.count, About{"number of sensors", "", 1, kMaxSensors});
}

/// An option with several values, or with random ones.
struct Variation {
  std::string key;                 // dotted, within the sensor
  std::vector<YAML::Node> values;  // a dimension of the grid; empty: a distribution
  Distribution distribution{};
  std::uint16_t stream = 0;  // of the distribution's random numbers
};

std::string text_of(const YAML::Node& node) {
  YAML::Emitter text;
  text << YAML::Flow << node;
  return text.c_str();
}

bool varies(const YAML::Node& node) {
  return node.IsMap() && std::any_of(node.begin(), node.end(), [](const auto& entry) {
           return entry.first.IsScalar() && (entry.first.Scalar() == kValues || is_distribution(entry.first.Scalar()));
         });
}

bool contains_variation(const YAML::Node& node) {
  if (!node.IsMap()) return false;
  return varies(node) ||
         std::any_of(node.begin(), node.end(), [](const auto& entry) { return contains_variation(entry.second); });
}

/// Whether a map describes more than one sensor with fixed options.
bool describes_several(const YAML::Node& map) {
  return map.IsMap() && (map["count"].IsDefined() || contains_variation(map));
}

std::string child(const std::string& where, const YAML::Node& name) {
  return where.empty() ? name.Scalar() : where + "." + name.Scalar();
}

/// Finds the variations in a map, in its order. `key`: of the sensor, for messages.
void find_variations(const YAML::Node& map, const std::string& where, const std::string& key, const YamlSource& source,
                     std::uint16_t& distributions, std::vector<Variation>& found) {
  for (const auto& entry : map) {
    if (!entry.first.IsScalar() || !entry.second.IsMap()) continue;
    const std::string option = child(where, entry.first);
    if (!varies(entry.second)) {
      find_variations(entry.second, option, key, source, distributions, found);
      continue;
    }
    const auto fail = [&](const std::string& problem) {
      YamlReader::fail(source, entry.second, key + "." + option, problem);
    };
    Variation variation{option, {}};
    if (entry.second.size() == 1 && entry.second.begin()->first.Scalar() == kValues) {
      const YAML::Node values = entry.second.begin()->second;
      if (!values.IsSequence() || values.size() == 0) fail("values: must be a list of at least one value");
      for (const YAML::Node& value : values) variation.values.push_back(value);
    } else {
      try {
        variation.distribution = read_distribution(text_of(entry.second));
      } catch (const UserError& error) {
        fail(error.what());
      }
      variation.stream = ++distributions;
    }
    found.push_back(std::move(variation));
  }
}

/// The map with other values of some options, by their dotted keys.
YAML::Node with_values(const YAML::Node& map, const std::string& where,
                       const std::vector<std::pair<std::string, YAML::Node>>& values) {
  YAML::Node changed(YAML::NodeType::Map);
  for (const auto& entry : map) {
    const std::string option = entry.first.IsScalar() ? child(where, entry.first) : std::string();
    const auto value = std::ranges::find(values, option, &std::pair<std::string, YAML::Node>::first);
    const bool inside =
        std::ranges::any_of(values, [&](const auto& each) { return each.first.starts_with(option + "."); });
    if (where.empty() && option == "count") continue;
    if (value != values.end()) {
      changed.force_insert(entry.first, value->second);
    } else {
      changed.force_insert(entry.first, inside ? with_values(entry.second, option, values) : entry.second);
    }
  }
  return changed;
}

}  // namespace

/// Appends the sensors that a map describes.
void SensorList::add(const YAML::Node& map, const std::string& key, bool listed, const YamlSource& source,
                     std::vector<SensorOptions>& sensors) {
  std::vector<Variation> variations;
  std::optional<int> count;
  if (map.IsMap()) {
    find_variations(map, "", key, source, distributions_, variations);
    if (const YAML::Node given = map["count"]; given.IsDefined()) {
      YAML::Node alone(YAML::NodeType::Map);
      alone["count"] = given;
      Count read;
      YamlReader reader(alone, key, source);
      describe(reader, read);
      count = read.count;
    }
  }
  std::size_t grid = 1;
  for (const Variation& variation : variations) {
    grid *= std::max<std::size_t>(1, variation.values.size());
    if (grid > kMaxSensors) break;
  }
  const std::size_t total = grid * static_cast<std::size_t>(count.value_or(1));
  if (sensors.size() + total > kMaxSensors) {
    YamlReader::fail(
        source, map, key,
        fmt::format("a camera can have at most {} event sensors; give fewer values, or a smaller count", kMaxSensors));
  }
  const bool has_seed = map.IsMap() && map["seed"].IsDefined();
  const bool numbered = count || grid > 1;
  const bool names_vary = std::ranges::find(variations, "name", &Variation::key) != variations.end();
  for (std::size_t i = 0; i < total; ++i) {
    std::size_t place = i / static_cast<std::size_t>(count.value_or(1));  // in the grid
    std::size_t places = grid;                                            // of the options from here on
    std::vector<std::pair<std::string, YAML::Node>> values;
    YamlSource of_sensor = source;
    for (const Variation& variation : variations) {
      if (!variation.values.empty()) {
        places /= variation.values.size();
        values.emplace_back(variation.key, variation.values[place / places]);
        place %= places;
      } else {
        const AddressedRandom random(seed_, Purpose::sensor_choice, variation.stream);
        values.emplace_back(variation.key,
                            YAML::Load(draw(variation.distribution, random, static_cast<std::uint32_t>(i))));
        of_sensor.has_lines = false;  // a drawn value is not in the text
      }
    }
    SensorOptions sensor;
    YamlReader reader(map.IsMap() ? with_values(map, "", values) : map, key, of_sensor);
    describe(reader, sensor);
    reader.finish();
    for (const auto& [option, value] : values) sensor.varied.push_back({option, text_of(value)});
    if (count && !has_seed) {
      const auto words = AddressedRandom(seed_, Purpose::sensor_choice, kSeeds).bits(static_cast<std::uint32_t>(i));
      sensor.seed = (std::uint64_t{words[0]} << 31) | words[1];
      sensor.varied.push_back({"seed", std::to_string(*sensor.seed)});
    }
    if (sensor.name.empty() && (listed || numbered)) {
      sensor.name = fmt::format("sensor{}", sensors.size());
    } else if (numbered && !names_vary) {
      sensor.name += std::to_string(i);
    }
    sensors.push_back(std::move(sensor));
  }
}

std::vector<SensorOptions> SensorList::read(const YAML::Node& event_camera, const YAML::Node& event_cameras,
                                            const std::string& camera, const YamlSource& source) {
  std::vector<SensorOptions> sensors;
  if (!event_cameras.IsDefined() || event_cameras.IsNull()) {
    if (event_camera.IsDefined() && describes_several(event_camera))
      add(event_camera, camera + ".event_camera", false, source, sensors);
    return sensors;
  }
  const std::string key = camera + ".event_cameras";
  if (!event_cameras.IsSequence() || event_cameras.size() == 0)
    YamlReader::fail(source, event_cameras, key,
                     "must be a list of at least one sensor, such as [{name: low, contrast_threshold: 0.1}]");
  for (std::size_t i = 0; i < event_cameras.size(); ++i)
    add(inherit(event_camera, event_cameras[i]), fmt::format("{}.{}", key, i), true, source, sensors);
  return sensors;
}

}  // namespace esim::inline scenario
