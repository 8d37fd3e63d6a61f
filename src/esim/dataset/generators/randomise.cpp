#include "esim/dataset/generators/randomise.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <utility>

#include "esim/core/error.h"
#include "esim/core/random.h"

namespace esim::inline dataset {
namespace {

constexpr const char* kKey = "randomise";

}  // namespace

std::string draw(const Distribution& distribution, std::uint64_t seed, std::uint32_t sequence, std::uint16_t option) {
  return draw(distribution, AddressedRandom(seed, Purpose::dataset_choice, option), sequence);
}

ScenarioTemplate read_template(const std::string& text, const std::string& name) {
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw UserError(fmt::format("{}:{}: {}", name, error.mark.line + 1, error.msg));
  }
  if (!root.IsMap()) throw UserError(name + ": must be a scenario, which is a map of keys and values");
  ScenarioTemplate result;
  const YAML::Node random = std::as_const(root)[kKey];
  if (random.IsDefined()) {
    if (!random.IsMap()) throw UserError(fmt::format("{}: {}: must be a map of keys to distributions", name, kKey));
    for (const auto& entry : random) {
      const std::string key = entry.first.Scalar();
      YAML::Emitter yaml;
      yaml << YAML::Flow << entry.second;
      try {
        result.options.push_back({key, read_distribution(yaml.c_str()), yaml.c_str()});
      } catch (const UserError& error) {
        throw UserError(fmt::format("{}:{}: {}.{}: {}", name, entry.second.Mark().line + 1, kKey, key, error.what()));
      }
    }
    root.remove(kKey);
  }
  YAML::Emitter out;
  out << root;
  result.yaml = out.c_str();
  return result;
}

}  // namespace esim::inline dataset
