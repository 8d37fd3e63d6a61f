#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>

// Private to scenario: includes yaml-cpp/yaml.h.
namespace esim::inline scenario {

/// A map with the entries of `base`, of which those of `over` replace the ones with the same key. Entries keep their
/// lines, which YAML::Clone() would lose.
YAML::Node merged(const YAML::Node& base, const YAML::Node& over);

/// A map without some of its entries.
YAML::Node without(const YAML::Node& map, std::initializer_list<const char*> keys);

/// The map that applies to a part: the shared map, overridden entry by entry by the part's own. A map with another
/// `type` replaces the shared one. Both may be undefined.
YAML::Node inherit(const YAML::Node& shared, const YAML::Node& own);

}  // namespace esim::inline scenario
