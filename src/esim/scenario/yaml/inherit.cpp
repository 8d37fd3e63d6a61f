#include "esim/scenario/yaml/inherit.h"

#include <algorithm>

namespace esim::inline scenario {

YAML::Node merged(const YAML::Node& base, const YAML::Node& over) {
  YAML::Node map(YAML::NodeType::Map);
  for (const auto& entry : base) {
    if (!entry.first.IsScalar() || !over[entry.first.Scalar()].IsDefined()) map.force_insert(entry.first, entry.second);
  }
  for (const auto& entry : over) map.force_insert(entry.first, entry.second);
  return map;
}

YAML::Node without(const YAML::Node& map, std::initializer_list<const char*> keys) {
  YAML::Node rest(YAML::NodeType::Map);
  for (const auto& entry : map) {
    const bool kept = !entry.first.IsScalar() ||
                      std::ranges::none_of(keys, [&](const char* key) { return entry.first.Scalar() == key; });
    if (kept) rest.force_insert(entry.first, entry.second);
  }
  return rest;
}

YAML::Node inherit(const YAML::Node& shared, const YAML::Node& own) {
  if (!shared.IsDefined() || !own.IsDefined()) return own.IsDefined() ? own : shared;
  if (!shared.IsMap() || !own.IsMap()) return own;
  const YAML::Node own_type = own["type"], shared_type = shared["type"];
  if (own_type.IsDefined() && (!shared_type.IsDefined() || own_type.Scalar() != shared_type.Scalar())) return own;
  return merged(shared, own);
}

}  // namespace esim::inline scenario
