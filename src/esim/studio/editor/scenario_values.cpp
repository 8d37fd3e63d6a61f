#include "esim/studio/editor/scenario_values.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "esim/scenario/read.h"

namespace esim::studio {
namespace {

/// Aliases of anchors share nodes, so that a small text may be an endless tree.
constexpr int kMaxNodes = 1 << 20, kMaxDepth = 64;

Json scalar_json(const YAML::Node& node) {
  const std::string& text = node.Scalar();
  if (node.Tag() == "!" || text.empty()) return text;
  if (text == "true" || text == "True" || text == "TRUE") return true;
  if (text == "false" || text == "False" || text == "FALSE") return false;
  if (text.find_first_not_of("+-.0123456789eE") != std::string::npos) return text;
  std::int64_t whole = 0;
  const bool digits = text.find_first_not_of("0123456789", text.front() == '-' ? 1 : 0) == std::string::npos;
  if (digits && YAML::convert<std::int64_t>::decode(node, whole)) return whole;
  double number = 0;
  if (YAML::convert<double>::decode(node, number) && std::isfinite(number)) return number;
  return text;
}

Json node_json(const YAML::Node& node, int depth, int& nodes) {
  if (++nodes > kMaxNodes || depth > kMaxDepth)
    throw UserError("the scenario is nested too deeply, is too large, or has an alias that contains itself");
  if (node.IsMap()) {
    Json object = Json::object();
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) throw UserError("the keys of a scenario must be plain words");
      object[entry.first.Scalar()] = node_json(entry.second, depth + 1, nodes);
    }
    return object;
  }
  if (node.IsSequence()) {
    Json list = Json::array();
    for (const auto& entry : node) list.push_back(node_json(entry, depth + 1, nodes));
    return list;
  }
  return node.IsScalar() ? scalar_json(node) : Json();
}

YAML::Node parse(const std::string& yaml, const std::string& name) {
  try {
    YAML::Node root = YAML::Load(yaml);
    if (root.IsNull()) return YAML::Node(YAML::NodeType::Map);
    if (!root.IsMap()) throw UserError(name + ": a scenario must be a map of keys and values");
    return root;
  } catch (const YAML::Exception& exception) {
    const int line = exception.mark.line + 1;
    const std::string problem = "not valid YAML: " + exception.msg;
    throw OptionError(fmt::format("{}:{}: {}", name, line, problem), "", problem, line);
  }
}

}  // namespace

Json values_of(const std::string& yaml, const std::string& name) {
  int nodes = 0;
  return node_json(parse(yaml, name), 0, nodes);
}

}  // namespace esim::studio
