#include "esim/scenario/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>

#include "esim/core/inputs/used_files.h"

namespace esim::inline scenario {
namespace {

/// Replaces every ${NAME} by the environment variable NAME.
std::string expand_environment(const std::string& text, const YamlSource& source, const YAML::Node& node,
                               const std::string& key) {
  std::string out;
  std::size_t position = 0;
  while (true) {
    const std::size_t open = text.find("${", position);
    const std::size_t close = open == std::string::npos ? open : text.find('}', open);
    if (close == std::string::npos) return out + text.substr(position);
    const std::string name = text.substr(open + 2, close - open - 2);
    const char* value = std::getenv(name.c_str());
    if (value == nullptr) YamlReader::fail(source, node, key, fmt::format("environment variable {} is not set", name));
    out += text.substr(position, open - position) + value;
    position = close + 1;
  }
}

std::string scalar(const YamlSource& source, const YAML::Node& node, const std::string& key, const char* kind) {
  if (!node.IsScalar()) YamlReader::fail(source, node, key, fmt::format("must be {}", kind));
  return node.Scalar();
}

}  // namespace

std::string text_of(const std::filesystem::path& file, const char* kind) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(fmt::format("{}: no such {}", file.string(), kind));
  std::ifstream stream = open_input(file);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw UserError(fmt::format("{}: cannot be read; check its permissions", file.string()));
  return text;
}

YAML::Node parse_yaml(const std::string& yaml, const std::filesystem::path& file) {
  try {
    return YAML::Load(yaml);
  } catch (const YAML::Exception& exception) {
    throw UserError(fmt::format("{}:{}: not valid YAML: {}", file.string(), exception.mark.line + 1, exception.msg));
  }
}

void remove_option(const YAML::Node& root, const std::string& key) {
  const auto index = [](const std::string& part) {
    std::size_t value = std::numeric_limits<std::size_t>::max();
    std::from_chars(part.data(), part.data() + part.size(), value);
    return value;
  };
  YAML::Node node = root;
  for (std::size_t begin = 0, dot = 0; dot != std::string::npos; begin = dot + 1) {
    dot = key.find('.', begin);
    const std::string part = key.substr(begin, dot == std::string::npos ? dot : dot - begin);
    const YAML::Node& parent = node;
    const YAML::Node child = parent.IsSequence() ? parent[index(part)] : parent.IsMap() ? parent[part] : YAML::Node();
    if (!child.IsDefined()) return;
    if (dot != std::string::npos) {
      node.reset(child);
    } else if (node.IsSequence()) {
      node.remove(index(part));
    } else if (node.IsMap()) {
      node.remove(part);
    }
  }
}

std::string apply_override(const YAML::Node& root, const std::string& text, const std::string& setter) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw UserError(
        fmt::format("{}{}: expected key=value, for example event_camera.contrast_threshold=0.2", setter, text));
  }
  const std::string key = text.substr(0, equals);
  try {
    const YAML::Node value = YAML::Load(text.substr(equals + 1));
    std::size_t begin = 0;
    YAML::Node node = root;
    while (true) {
      const std::size_t dot = key.find('.', begin);
      const std::string part = key.substr(begin, dot == std::string::npos ? dot : dot - begin);
      YAML::Node child = node.IsSequence() ? node[std::stoul(part)] : node[part];
      if (dot == std::string::npos) {
        child = value;
        return key;
      }
      node.reset(child);
      begin = dot + 1;
    }
  } catch (const YAML::Exception& exception) {
    throw UserError(fmt::format("{}{}: cannot be set: {}", setter, text, exception.msg));
  } catch (const std::logic_error&) {
    throw UserError(fmt::format("{}{}: an entry of a list must be given by its number", setter, text));
  }
}

YamlReader::YamlReader(const YAML::Node& map, std::string where, const YamlSource& source)
    : map_(map), where_(std::move(where)), source_(source) {
  if (!map.IsMap()) {
    if (where_.empty())
      throw UserError(fmt::format("{}: a scenario must be a map of keys and values; see scenes/*.yaml for examples",
                                  source.file.string()));
    fail(source, map, where_, "must be a map of keys and values");
  }
  std::set<std::string> seen;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar())
      fail(source, entry.first, where_.empty() ? "scenario" : where_, "keys must be plain words");
    if (!seen.insert(entry.first.Scalar()).second)
      fail(source, entry.first, child(entry.first.Scalar()), "appears twice; remove one");
  }
}

void YamlReader::fail(const YamlSource& source, const YAML::Node& node, const std::string& key,
                      const std::string& message) {
  const auto& changed = source.changed;
  const bool from_command_line = std::any_of(changed.begin(), changed.end(), [&](const std::string& set) {
    return key == set || key.starts_with(set + ".") || set.starts_with(key + ".");
  });
  if (from_command_line) throw OptionError(fmt::format("{}{}: {}", source.setter, key, message), key, message);
  const YAML::Mark mark = node.IsDefined() ? node.Mark() : YAML::Mark::null_mark();
  const int line = source.has_lines && mark.line >= 0 ? mark.line + 1 : 0;
  const std::string place = source.file.string() + (line > 0 ? fmt::format(":{}", line) : "");
  throw OptionError(fmt::format("{}: {}: {}", place, key, message), key, message, line);
}

void YamlReader::finish() const {
  for (const auto& entry : map_) {
    const std::string& key = entry.first.Scalar();
    if (known_.contains(key)) continue;
    const std::vector<std::string> known(known_.begin(), known_.end());
    const std::string suggestion = nearest(key, known);
    fail(source_, entry.first, child(key),
         suggestion.empty() ? fmt::format("unknown key; valid keys are {}", list(known))
                            : fmt::format("unknown key; did you mean {}?", suggestion));
  }
}

double YamlReader::number(const YAML::Node& node, const std::string& key, const About& about, const char* kind) {
  const std::string text = scalar(source_, node, key, kind);
  double value = 0;
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail(source_, node, key, fmt::format("must be {}, not '{}'", kind, text));
  }
  const bool too_small = about.above_min ? value <= about.min : value < about.min;
  if (!too_small && value <= about.max) return value;
  const std::string unit = *about.unit != '\0' ? std::string(" ") + about.unit : "";
  const std::string lower =
      std::isfinite(about.min) ? fmt::format("{} {}{}", about.above_min ? "above" : "at least", about.min, unit) : "";
  const std::string upper = std::isfinite(about.max) ? fmt::format("at most {}{}", about.max, unit) : "";
  fail(source_, node, key,
       fmt::format("{} is out of range: must be {}{}{}", text, lower, lower.empty() || upper.empty() ? "" : " and ",
                   upper));
}

void YamlReader::read(const YAML::Node& node, const std::string& key, double& value, const About& about) {
  value = number(node, key, about, "a number");
}

void YamlReader::read(const YAML::Node& node, const std::string& key, int& value, const About& about) {
  const double number_value = number(node, key, about, "a whole number");
  if (number_value != std::floor(number_value) || std::fabs(number_value) > 2e9)
    fail(source_, node, key, fmt::format("must be a whole number, not '{}'", node.Scalar()));
  value = static_cast<int>(number_value);
}

void YamlReader::read(const YAML::Node& node, const std::string& key, std::uint64_t& value, const About&) {
  const std::string text = scalar(source_, node, key, "a whole number");
  if (text.empty() || text.find_first_not_of("0123456789") != std::string::npos ||
      !YAML::convert<std::uint64_t>::decode(node, value)) {
    fail(source_, node, key, fmt::format("must be a whole number from 0 to 2^64 - 1, not '{}'", text));
  }
}

void YamlReader::read(const YAML::Node& node, const std::string& key, bool& value, const About&) {
  const std::string text = scalar(source_, node, key, "true or false");
  if (!YAML::convert<bool>::decode(node, value))
    fail(source_, node, key, fmt::format("must be true or false, not '{}'", text));
}

void YamlReader::read(const YAML::Node& node, const std::string& key, std::string& value, const About&) {
  value = scalar(source_, node, key, "text");
}

void YamlReader::read(const YAML::Node& node, const std::string& key, std::filesystem::path& value, const About&) {
  const std::string text = expand_environment(scalar(source_, node, key, "a path"), source_, node, key);
  if (text.empty()) {
    value.clear();
    return;
  }
  value = (std::filesystem::absolute(source_.file).parent_path() / text).lexically_normal();
  if (!source_.refuses) return;
  if (const std::string problem = source_.refuses(value); !problem.empty()) fail(source_, node, key, problem);
}

std::size_t YamlReader::index_of_name(const YAML::Node& node, const std::string& key,
                                      const std::vector<std::string>& names) {
  const std::string text = scalar(source_, node, key, ("one of " + list(names)).c_str());
  const auto found = std::find(names.begin(), names.end(), text);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  const std::string suggestion = nearest(text, names);
  fail(source_, node, key,
       fmt::format("'{}' is not one of {}{}", text, list(names),
                   suggestion.empty() ? "" : "; did you mean " + suggestion + "?"));
}

}  // namespace esim::inline scenario
