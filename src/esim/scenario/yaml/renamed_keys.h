#pragma once

#include <string>
#include <vector>

#include "esim/scenario/yaml/yaml_reader.h"

// Private to scenario.
namespace esim::inline scenario {

/// Replaces old names in a dotted key, such as "truth.flow", by the present ones. Appends a notice for each.
std::string with_present_names(const std::string& key, std::vector<std::string>& notices);

/// The same for all keys of a scenario. Throws OptionError if a map has an option under both names.
void use_present_names(const YAML::Node& root, const YamlSource& source, std::vector<std::string>& notices);

}  // namespace esim::inline scenario
