#include "esim/studio/editor/yaml_text.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "esim/studio/server/http.h"

namespace esim::studio {
namespace {

using Path = std::vector<std::string>;

// --- text to values ---

/// Aliases of anchors share nodes, so that a small text may be an endless tree.
constexpr int kMaxNodes = 1 << 20, kMaxDeep = 64;

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

Json json_of(const YAML::Node& node, int depth, int& nodes) {
  if (++nodes > kMaxNodes || depth > kMaxDeep)
    throw UserError("the scenario is nested too deeply, is too large, or has an alias that contains itself");
  if (node.IsMap()) {
    Json object = Json::object();
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) throw UserError("the keys of a scenario must be plain words");
      object[entry.first.Scalar()] = json_of(entry.second, depth + 1, nodes);
    }
    return object;
  }
  if (node.IsSequence()) {
    Json list = Json::array();
    for (const auto& entry : node) list.push_back(json_of(entry, depth + 1, nodes));
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
    throw UserError(fmt::format("{}:{}: not valid YAML: {}", name, exception.mark.line + 1, exception.msg));
  }
}

// --- values to text ---

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

/// Without quotes if they are not needed.
std::string text_scalar(const std::string& text) {
  const bool plain = !text.empty() &&
                     text.find_first_not_of(
                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456"
                         "789_-./") == std::string::npos &&
                     text.front() != '-';
  if (!plain || text == "null" || text == "yes" || text == "no" || text == "on" || text == "off") return quoted(text);
  return scalar_json(YAML::Node(text)).is_string() ? text : quoted(text);
}

std::string number_text(const Json& value) {
  return value.is_number_float() ? fmt::format("{}", value.get<double>()) : value.dump();
}

bool is_list_of_maps(const Json& value) {
  return value.is_array() && !value.empty() &&
         std::all_of(value.begin(), value.end(), [](const Json& entry) { return entry.is_object(); });
}

/// The text of a value after the colon of a key at column `indent`.
std::string block_text(const Json& value, std::size_t indent) {
  constexpr std::size_t kLineWidth = 100;
  const std::string line = yaml_of(value);
  const std::string margin = "\n" + std::string(indent + 2, ' ');
  std::string out;
  if (is_list_of_maps(value)) {
    for (const Json& entry : value) out += margin + "- " + yaml_of(entry);
    return out;
  }
  if (!value.is_object() || value.empty() || line.size() + indent < kLineWidth) return " " + line;
  for (const auto& [key, member] : value.items())
    out += margin + text_scalar(key) + ":" + block_text(member, indent + 2);
  return out;
}

// --- places in the text ---

bool is_space(char c) { return c == ' ' || c == '\t'; }

std::size_t end_of_line(const std::string& text, std::size_t from) {
  return std::min(text.find('\n', from), text.size());
}

std::size_t start_of_line(const std::string& text, std::size_t at) {
  const std::size_t newline = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  return newline == std::string::npos ? 0 : newline + 1;
}

std::size_t after_quotes(const std::string& text, std::size_t from) {
  const char quote = text[from];
  for (std::size_t i = from + 1; i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\') {
      ++i;
    } else if (text[i] == quote) {
      if (quote == '"' || i + 1 >= text.size() || text[i + 1] != '\'') return i + 1;
      ++i;
    }
  }
  return text.size();
}

std::size_t after_brackets(const std::string& text, std::size_t from) {
  int depth = 0;
  for (std::size_t i = from; i < text.size(); ++i) {
    const char c = text[i];
    const bool begins =
        is_space(text[i > 0 ? i - 1 : 0]) || std::string("[{,:\n").find(text[i > 0 ? i - 1 : 0]) != std::string::npos;
    if ((c == '"' || c == '\'') && begins) {
      i = after_quotes(text, i) - 1;
    } else if (c == '#' && (is_space(text[i - 1]) || text[i - 1] == '\n')) {
      i = end_of_line(text, i);
    } else if (c == '{' || c == '[') {
      ++depth;
    } else if ((c == '}' || c == ']') && --depth == 0) {
      return i + 1;
    }
  }
  return text.size();
}

/// The end of a value that begins at `from`, below a key (or a dash) at column `column`. `flow`: between brackets.
std::size_t end_of_value(const std::string& text, std::size_t from, std::size_t column, bool flow, bool sequence) {
  if (from >= text.size()) return text.size();
  if (text[from] == '{' || text[from] == '[') return after_brackets(text, from);
  if (text[from] == '"' || text[from] == '\'') return after_quotes(text, from);
  std::size_t end = from;
  while (end < text.size() && text[end] != '\n') {
    if (flow && std::string(",]}").find(text[end]) != std::string::npos) break;
    if (text[end] == '#' && end > 0 && is_space(text[end - 1])) break;
    ++end;
  }
  const auto trimmed = [&](std::size_t e) {
    while (e > from && is_space(text[e - 1])) --e;
    return e;
  };
  if (flow) return trimmed(end);
  // A collection continues over the lines with a larger indent.
  std::size_t last = trimmed(end);
  for (std::size_t line = end_of_line(text, from) + 1; line < text.size(); line = end_of_line(text, line) + 1) {
    const std::size_t stop = end_of_line(text, line);
    const std::size_t first = std::min(text.find_first_not_of(" \t", line), stop);
    if (first == stop || text[first] == '#') continue;
    const bool item = sequence && first - line == column && text[first] == '-';
    if (first - line <= column && !item) break;
    last = stop;
  }
  return last;
}

// --- setting ---

bool is_flow(const YAML::Node& node) { return node.Style() == YAML::EmitterStyle::Flow; }

std::optional<std::size_t> index_of(const std::string& part) {
  constexpr std::size_t kMaxDigits = 6;
  if (part.empty() || part.size() > kMaxDigits || part.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  return std::stoul(part);
}

/// The tree after the change.
void set_in(Json& tree, const Path& path, const Json& value, std::size_t depth = 0) {
  const std::string& part = path[depth];
  const bool last = depth + 1 == path.size();
  if (tree.is_array()) {
    const auto index = index_of(part);
    if (!index || *index > tree.size())
      throw UserError(fmt::format("{}: an entry of a list must be given by its number", part));
    if (last && value.is_null()) {
      if (*index < tree.size()) tree.erase(*index);
      return;
    }
    if (*index == tree.size()) tree.push_back(Json());
    if (!last) return set_in(tree[*index], path, value, depth + 1);
    tree[*index] = value;
    return;
  }
  if (last && value.is_null()) {
    if (tree.is_object()) tree.erase(part);
    return;
  }
  if (!tree.is_object()) {
    if (value.is_null()) return;
    tree = Json::object();
  }
  if (last) {
    tree[part] = value;
  } else if (!value.is_null() || tree.contains(part)) {
    set_in(tree[part], path, value, depth + 1);
  }
}

/// An entry of a map or of a list in the text.
struct Place {
  std::size_t key = 0;    // start of the key or of the dash
  std::size_t value = 0;  // start of the value
  std::size_t end = 0;
  bool flow = false;
  bool in_list = false;
};

/// Edits the text itself. Returns nothing for unsupported cases.
class TextEdit {
 public:
  TextEdit(const std::string& text, const Json& wanted, bool removes)
      : text_(text), wanted_(wanted), removes_(removes) {}

  std::optional<std::string> set(const YAML::Node& root, const Path& path) {
    YAML::Node node = root;
    const Json* want = &wanted_;
    std::optional<Place> place;
    for (std::size_t depth = 0; depth < path.size(); ++depth) {
      const std::string& part = path[depth];
      // Later entries of a list move up.
      if (removes_ && want->is_array() && depth + 1 == path.size()) return replace(place, *want);
      const bool wants = want->is_array() ? index_of(part).value_or(want->size()) < want->size() : want->contains(part);
      const auto found = find(node, part);
      if (!wants) {  // it is removed
        if (!found || !node.IsMap() || node.size() < 2 || found->second.flow) return replace(place, *want);
        return without(found->second);
      }
      const Json& next = want->is_array() ? (*want)[*index_of(part)] : (*want)[part];
      if (!found) return add(node, place, *want, part, next);
      const bool same_kind =
          (found->first.IsMap() && next.is_object()) || (found->first.IsSequence() && next.is_array());
      place = found->second;
      if (depth + 1 == path.size() || !same_kind) return replace(place, next);
      node.reset(found->first);
      want = &next;
    }
    return std::nullopt;
  }

 private:
  std::optional<std::pair<YAML::Node, Place>> find(const YAML::Node& node, const std::string& part) const {
    if (node.IsSequence()) {
      const auto index = index_of(part);
      if (!index || *index >= node.size()) return std::nullopt;
      const YAML::Node entry = node[*index];
      const auto start = static_cast<std::size_t>(entry.Mark().pos);
      const auto column = static_cast<std::size_t>(std::max(entry.Mark().column, 1));
      return std::pair(entry, Place{start, start, end_of_value(text_, start, column - 1, is_flow(node), false),
                                    is_flow(node), true});
    }
    if (!node.IsMap()) return std::nullopt;
    for (const auto& entry : node) {
      if (entry.first.Scalar() != part) continue;
      Place place;
      place.key = static_cast<std::size_t>(entry.first.Mark().pos);
      place.flow = is_flow(node);
      const std::size_t colon = text_.find(':', after_key(place.key));
      if (colon == std::string::npos) return std::nullopt;
      place.value = colon + 1;
      if (entry.second.IsNull()) {
        place.end = place.value;
      } else {
        const auto start = static_cast<std::size_t>(entry.second.Mark().pos);
        if (start < place.value) return std::nullopt;
        place.end = end_of_value(text_, start, column_of(place.key), place.flow, entry.second.IsSequence());
      }
      return std::pair(entry.second, place);
    }
    return std::nullopt;
  }

  std::size_t after_key(std::size_t at) const {
    return text_[at] == '"' || text_[at] == '\'' ? after_quotes(text_, at) : at;
  }
  std::size_t column_of(std::size_t at) const { return at - start_of_line(text_, at); }

  std::optional<std::string> replace(const std::optional<Place>& place, const Json& value) const {
    if (!place) return std::nullopt;
    std::string written = place->flow ? " " + yaml_of(value) : block_text(value, column_of(place->key));
    if (place->in_list) written = yaml_of(value);
    return text_.substr(0, place->value) + written + text_.substr(place->end);
  }

  std::optional<std::string> without(const Place& place) const {
    const std::size_t begin = start_of_line(text_, place.key);
    if (text_.find_first_not_of(' ', begin) != place.key) return std::nullopt;
    return text_.substr(0, begin) + text_.substr(std::min(end_of_line(text_, place.end) + 1, text_.size()));
  }

  /// A new entry at the end of a map; a list is written completely.
  std::optional<std::string> add(const YAML::Node& node, const std::optional<Place>& place, const Json& all,
                                 const std::string& part, const Json& value) const {
    if (node.IsMap() && node.size() == 0 && !place) return append(text_.size(), 0, part, value);
    if (!node.IsMap() || node.size() == 0) return replace(place, all);
    if (is_flow(node)) {
      const std::size_t close = after_brackets(text_, static_cast<std::size_t>(node.Mark().pos)) - 1;
      return text_.substr(0, close) + ", " + text_scalar(part) + ": " + yaml_of(value) + text_.substr(close);
    }
    YAML::Node last;
    for (const auto& entry : node) last.reset(entry.first);
    const auto found = find(node, last.Scalar());
    if (!found) return std::nullopt;
    return append(end_of_line(text_, found->second.end), column_of(found->second.key), part, value);
  }

  std::string append(std::size_t at, std::size_t indent, const std::string& part, const Json& value) const {
    std::string before = text_.substr(0, at);
    if (!before.empty() && before.back() != '\n') before += "\n";
    const std::string rest = text_.substr(at);
    return before + std::string(indent, ' ') + text_scalar(part) + ":" + block_text(value, indent) +
           (rest.starts_with('\n') ? rest : "\n" + rest);
  }

  const std::string& text_;
  const Json& wanted_;
  bool removes_;
};

bool same(const Json& a, const Json& b) { return nlohmann::json(a) == nlohmann::json(b); }

/// A text with the values `wanted` that keeps as much of the old text as possible.
std::string rewritten(const Json& wanted) {
  std::string out;
  for (const auto& [key, value] : wanted.items()) out += text_scalar(key) + ":" + block_text(value, 0) + "\n";
  return out.empty() ? "{}\n" : out;
}

}  // namespace

Json values_of(const std::string& yaml, const std::string& name) {
  int nodes = 0;
  return json_of(parse(yaml, name), 0, nodes);
}

std::string yaml_of(const Json& value) {
  std::string out;
  if (value.is_array()) {
    for (const Json& entry : value) out += (out.empty() ? "" : ", ") + yaml_of(entry);
    return "[" + out + "]";
  }
  if (value.is_object()) {
    for (const auto& [key, member] : value.items())
      out += (out.empty() ? "" : ", ") + text_scalar(key) + ": " + yaml_of(member);
    return "{" + out + "}";
  }
  if (value.is_string()) return text_scalar(value.get<std::string>());
  return value.is_number() ? number_text(value) : value.dump();
}

std::string with_option(const std::string& yaml, const std::string& key, const Json& value) {
  Path path;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    path.push_back(key.substr(begin, end - begin));
    if (path.back().empty()) throw UserError(fmt::format("'{}' is not an option", key));
    begin = end + 1;
  }
  if (path.size() > static_cast<std::size_t>(kMaxDeep)) throw UserError(fmt::format("'{}' is not an option", key));
  const Json before = values_of(yaml, "the scenario");
  Json wanted = before;
  set_in(wanted, path, value);
  if (same(before, wanted)) return yaml;
  const auto edited = TextEdit(yaml, wanted, value.is_null()).set(parse(yaml, "the scenario"), path);
  try {
    if (edited && same(values_of(*edited, ""), wanted)) return *edited;
  } catch (const UserError&) {  // the edit would have made the text invalid
  }
  return rewritten(wanted);
}

}  // namespace esim::studio
