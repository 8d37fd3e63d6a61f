#include "esim/scenario/sampling_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "esim/scenario/read.h"
#include "esim/scenario/yaml/yaml_reader.h"

namespace esim::inline scenario {
namespace {

/// {type: flow, lambda: 0.5} for "flow lambda=0.5".
YAML::Node map_of_words(const std::string& text) {
  YAML::Node map(YAML::NodeType::Map);
  std::istringstream words(text);
  std::string word;
  words >> word;
  map["type"] = word;
  while (words >> word) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
      throw UserError(fmt::format("scheme '{}': expected key=value, as in 'flow lambda=0.5', not '{}'", text, word));
    map[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return map;
}

YAML::Node map_of(const std::string& text) {
  if (text.find('{') == std::string::npos) return map_of_words(text);
  try {
    YAML::Node map(YAML::NodeType::Map);
    // A copy without line numbers, which would appear in messages.
    for (const auto& entry : YAML::Load(text)) map[entry.first.Scalar()] = entry.second.Scalar();
    return map;
  } catch (const YAML::Exception& exception) {
    throw UserError(fmt::format("scheme '{}': not valid YAML: {}", text, exception.msg));
  }
}

struct Entry {
  std::string key, value;
  bool operator==(const Entry&) const = default;
};

/// The options in order, the type first.
std::vector<Entry> entries(const SamplingOptions& options) {
  std::vector<Entry> all;
  for (const auto& entry : YAML::Load(write_sampling(options))) {
    const YAML::Node& value = entry.second;
    all.push_back({entry.first.Scalar(), value.IsScalar() ? value.Scalar() : YAML::Dump(value)});
  }
  return all;
}

std::string text_of(const SamplingOptions& options, bool with_first) {
  const std::vector<Entry> given = entries(options), usual = entries(read_sampling(given.front().value));
  std::string text = given.front().value;
  for (std::size_t i = 1; i < given.size(); ++i) {
    const bool differs = std::find(usual.begin(), usual.end(), given[i]) == usual.end();
    if (i == 1 ? with_first : differs) text += fmt::format(" {}={}", given[i].key, given[i].value);
  }
  return text;
}

template <typename... T>
std::vector<std::string> types_of(const std::variant<T...>&) {
  return {T::kType...};
}

}  // namespace

SamplingOptions read_sampling(const std::string& text) {
  YAML::Node root(YAML::NodeType::Map);
  root["sampling"] = map_of(text);
  const YamlSource source{fmt::format("scheme '{}'", text), {}};
  SamplingOptions options;
  YamlReader reader(root, "", source);
  reader("sampling", options, About{});
  reader.finish();
  return options;
}

std::string sampling_text(const SamplingOptions& options) { return text_of(options, true); }
std::string sampling_family(const SamplingOptions& options) { return text_of(options, false); }
std::vector<std::string> sampling_types() { return types_of(SamplingOptions{}); }

}  // namespace esim::inline scenario
