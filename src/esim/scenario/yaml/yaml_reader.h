#pragma once

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "esim/core/error.h"
#include "esim/core/named_value.h"
#include "esim/scenario/read.h"
#include "esim/scenario/schema.h"
#include "esim/scenario/suggest.h"

// Private to scenario: includes yaml-cpp/yaml.h.
namespace esim::inline scenario {

/// The origin of a scenario's text, for messages and for resolving paths.
struct YamlSource {
  std::filesystem::path file;        ///< of the scenario
  std::vector<std::string> changed;  ///< dotted keys that were set on the command line
  std::string setter = kSetter;      ///< beginning of messages about those
  bool has_lines = true;             ///< messages give line numbers

  /// As in ScenarioText.
  std::function<std::string(const std::filesystem::path& file)> refuses{};
};

/// The contents of a file of this kind. Throws UserError if it cannot be read.
std::string text_of(const std::filesystem::path& file, const char* kind);

/// Throws UserError with file and line for text that is not YAML.
YAML::Node parse_yaml(const std::string& yaml, const std::filesystem::path& file);

/// Removes root[a][b][c] for the key "a.b.c", if it exists; list entries are given by their index.
void remove_option(const YAML::Node& root, const std::string& key);

/// Sets root[a][b][c] for "a.b.c=value" and returns the key; list entries are given by their index. Messages begin with
/// `setter`.
std::string apply_override(const YAML::Node& root, const std::string& text, const std::string& setter = kSetter);

template <typename T>
inline constexpr bool kIsVariant = false;
template <typename... T>
inline constexpr bool kIsVariant<std::variant<T...>> = true;

/// A visitor of describe() that reads values from one YAML map. Every key of the map must be visited: unknown keys are
/// errors, reported with the most similar valid key.
class YamlReader {
 public:
  /// `where` is the dotted key of the map; empty for the whole file.
  YamlReader(const YAML::Node& map, std::string where, const YamlSource& source);

  /// Visits one member. If the map has its key, reads the value and checks its range.
  template <typename T>
  void operator()(const char* name, T& value, const About& about) {
    known_.insert(name);
    const YAML::Node node = std::as_const(map_)[name];
    if (node.IsDefined() && !node.IsNull()) read(node, child(name), value, about);
  }

  /// Marks a key as valid that is read elsewhere.
  void know(const char* name) { known_.insert(name); }

  /// Throws UserError if the map has a key that was not visited.
  void finish() const;

  /// Throws OptionError for the value of a key.
  [[noreturn]] static void fail(const YamlSource& source, const YAML::Node& node, const std::string& key,
                                const std::string& message);

 private:
  std::string child(const std::string& name) const { return where_.empty() ? name : where_ + "." + name; }

  void read(const YAML::Node& node, const std::string& key, bool& value, const About&);
  void read(const YAML::Node& node, const std::string& key, int& value, const About&);
  void read(const YAML::Node& node, const std::string& key, std::uint64_t& value, const About&);
  void read(const YAML::Node& node, const std::string& key, double& value, const About&);
  void read(const YAML::Node& node, const std::string& key, std::string& value, const About&);
  void read(const YAML::Node& node, const std::string& key, std::filesystem::path& value, const About&);

  template <int N>
  void read(const YAML::Node& node, const std::string& key, Eigen::Matrix<double, N, 1>& value, const About& about) {
    if (!node.IsSequence() || node.size() != N)
      fail(source_, node, key, "must be a list of " + std::to_string(N) + " numbers");
    for (int i = 0; i < N; ++i) read(node[i], key, value[i], about);
  }

  template <typename T>
  void read(const YAML::Node& node, const std::string& key, std::optional<T>& value, const About& about) {
    if (!value) value.emplace();
    read(node, key, *value, about);
  }

  template <typename T>
  void read(const YAML::Node& node, const std::string& key, std::vector<T>& values, const About& about) {
    if (!node.IsSequence()) fail(source_, node, key, "must be a list");
    values.assign(node.size(), T{});
    for (std::size_t i = 0; i < values.size(); ++i) read(node[i], key + "." + std::to_string(i), values[i], about);
  }

  template <typename T>
  requires std::is_enum_v<T>
  void read(const YAML::Node& node, const std::string& key, T& value, const About&) {
    value = static_cast<T>(index_of_name(node, key, {kEnumNames<T>.begin(), kEnumNames<T>.end()}));
  }

  template <NamedValue T>
  void read(const YAML::Node& node, const std::string& key, T& value, const About&) {
    const std::vector<std::string> names = T::names();
    if (node.IsScalar()) {
      if (const std::string problem = T::problem(node.Scalar()); !problem.empty()) fail(source_, node, key, problem);
      if (const std::optional<T> found = T::find(node.Scalar())) {
        value = *found;
        return;
      }
    }
    index_of_name(node, key, names);  // throws
  }

  template <typename T>
  requires std::is_class_v<T> &&
      (!kIsVariant<T> && !NamedValue<T>)void read(const YAML::Node& node, const std::string& key, T& value,
                                                  const About&) {
    YamlReader reader(node, key, source_);
    describe(reader, value);
    reader.finish();
  }

  template <typename... T>
  void read(const YAML::Node& node, const std::string& key, std::variant<T...>& value, const About&) {
    const std::vector<std::string> types = {T::kType...};
    if (node.IsScalar()) {
      const bool is_type = std::find(types.begin(), types.end(), node.Scalar()) != types.end();
      const std::string& example = is_type ? node.Scalar() : types.front();
      fail(source_, node, key, "must be a map with a type, such as {type: " + example + "}");
    }
    const YamlReader typed(node, key, source_);
    const YAML::Node type = node["type"];
    if (!type.IsDefined()) fail(source_, node, key, "needs a type: one of " + list(types));
    const std::size_t index = index_of_name(type, key + ".type", types);
    read_alternative(node, key, value, index, std::index_sequence_for<T...>{});
  }

  template <typename... T, std::size_t... I>
  void read_alternative(const YAML::Node& node, const std::string& key, std::variant<T...>& value, std::size_t index,
                        std::index_sequence<I...>) {
    // An alternative of the same type keeps the values of keys that the map lacks.
    const auto read_as = [&]<std::size_t Index>() {
      if (value.index() != Index) value.template emplace<Index>();
      YamlReader reader(node, key, source_);
      reader.know("type");
      describe(reader, std::get<Index>(value));
      reader.finish();
    };
    ((I == index ? read_as.template operator()<I>() : void()), ...);
  }

  std::size_t index_of_name(const YAML::Node& node, const std::string& key, const std::vector<std::string>& names);
  double number(const YAML::Node& node, const std::string& key, const About& about, const char* kind);

  YAML::Node map_;
  std::string where_;
  const YamlSource& source_;
  std::set<std::string> known_;
};

/// The default options with overrides "key=value". Throws UserError, which begins with `setter`, with the key.
template <typename Options>
Options read_overrides(const std::vector<std::string>& overrides, const std::string& setter) {
  YAML::Node root(YAML::NodeType::Map);
  YamlSource source;
  source.setter = setter;
  for (const std::string& text : overrides) source.changed.push_back(apply_override(root, text, setter));
  Options options;
  YamlReader reader(root, "", source);
  describe(reader, options);
  reader.finish();
  return options;
}

}  // namespace esim::inline scenario
