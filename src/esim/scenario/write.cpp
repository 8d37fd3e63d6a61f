#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <type_traits>
#include <variant>

#include "esim/core/named_value.h"
#include "esim/scenario/conversion.h"
#include "esim/scenario/read.h"
#include "esim/scenario/schema.h"

namespace esim::inline scenario {
namespace {

/// A visitor of describe() that writes every member into an open YAML map.
class YamlWriter {
 public:
  explicit YamlWriter(YAML::Emitter& out) : out_(out) {}

  template <typename T>
  void operator()(const char* name, const T& value, const About&) {
    if (is_unset(value)) return;
    out_ << YAML::Key << name << YAML::Value;
    write(value);
  }

 private:
  template <typename T>
  static bool is_unset(const T&) {
    return false;
  }
  template <typename T>
  static bool is_unset(const std::optional<T>& value) {
    return !value;
  }
  template <typename T>
  static bool is_unset(const std::vector<T>& value) {
    return value.empty();
  }
  static bool is_unset(const std::filesystem::path& value) { return value.empty(); }
  static bool is_unset(const std::string& value) { return value.empty(); }

  void write(bool value) { out_ << value; }
  void write(int value) { out_ << value; }
  void write(std::uint64_t value) { out_ << value; }
  void write(double value) { out_ << fmt::format("{}", value); }  // the shortest text that reads back the same
  void write(const std::string& value) { out_ << value; }
  void write(const std::filesystem::path& value) { out_ << value.string(); }

  template <int N>
  void write(const Eigen::Matrix<double, N, 1>& value) {
    out_ << YAML::Flow << YAML::BeginSeq;
    for (int i = 0; i < N; ++i) write(value[i]);
    out_ << YAML::EndSeq;
  }

  template <typename T>
  void write(const std::vector<T>& values) {
    out_ << YAML::BeginSeq;
    for (const T& value : values) write(value);
    out_ << YAML::EndSeq;
  }

  template <typename T>
  void write(const std::optional<T>& value) {
    write(*value);
  }

  template <typename T>
  requires std::is_enum_v<T>
  void write(T value) { out_ << kEnumNames<T>[static_cast<std::size_t>(value)]; }

  template <NamedValue T>
  void write(const T& value) {
    out_ << value.name();
  }

  template <typename T>
  requires std::is_class_v<T> &&(!NamedValue<T>)void write(const T& value) {
    out_ << YAML::BeginMap;
    describe_const(value);
    out_ << YAML::EndMap;
  }

  template <typename... T>
  void write(const std::variant<T...>& value) {
    out_ << YAML::BeginMap;
    std::visit(
        [&]<typename Alternative>(const Alternative& alternative) {
          out_ << YAML::Key << "type" << YAML::Value << Alternative::kType;
          describe_const(alternative);
        },
        value);
    out_ << YAML::EndMap;
  }

  template <typename T>
  void describe_const(const T& value) {
    T copy = value;
    describe(*this, copy);
  }

  YAML::Emitter& out_;
};

/// A visitor of describe() that documents every member on one line, nested members indented.
class ReferenceWriter {
 public:
  explicit ReferenceWriter(std::string& out, int depth = 0) : out_(out), depth_(depth) {}

  template <typename T>
  void operator()(const char* name, T& value, const About& about) {
    const std::string unit = *about.unit != '\0' ? fmt::format(" [{}]", about.unit) : "";
    line(fmt::format("{}:{}{}{}", name, default_of(value), unit, range_of(about)), about.help);
    nested(value);
  }

 private:
  static constexpr std::size_t kHelpColumn = 58;

  void line(const std::string& left, const char* help) {
    const std::string indented = std::string(static_cast<std::size_t>(2 * depth_), ' ') + left;
    out_ += *help != '\0' ? fmt::format("{:<{}} # {}\n", indented, kHelpColumn, help) : indented + "\n";
  }

  static std::string default_of(bool value) { return value ? " true" : " false"; }
  static std::string default_of(int value) { return fmt::format(" {}", value); }
  static std::string default_of(std::uint64_t value) { return fmt::format(" {}", value); }
  static std::string default_of(double value) { return fmt::format(" {}", value); }
  static std::string default_of(const std::string&) { return " TEXT"; }
  static std::string default_of(const std::filesystem::path&) { return " PATH"; }
  template <int N>
  static std::string default_of(const Eigen::Matrix<double, N, 1>& value) {
    std::string text;
    for (int i = 0; i < N; ++i) text += fmt::format("{}{}", i == 0 ? "" : ", ", value[i]);
    return fmt::format(" [{}]", text);
  }
  template <typename T>
  static std::string default_of(const std::optional<T>&) {
    return " (unset)";
  }
  template <typename T>
  static std::string default_of(const std::vector<T>&) {
    if constexpr (requires { T::Zero(); }) {
      return " a list of" + default_of(T(T::Zero()));  // Eigen leaves a new vector uninitialised
    } else {
      return " a list of" + default_of(T{});
    }
  }
  template <typename T>
  requires std::is_enum_v<T>
  static std::string default_of(T value) {
    std::string names;
    for (const char* name : kEnumNames<T>) names += fmt::format("{}{}", names.empty() ? "" : " | ", name);
    return fmt::format(" {} ({})", kEnumNames<T>[static_cast<std::size_t>(value)], names);
  }
  template <NamedValue T>
  static std::string default_of(const T& value) {
    std::string names;
    for (const std::string& name : T::names()) {
      if (name.find('@') == std::string::npos) names += (names.empty() ? "" : " | ") + name;
    }
    return fmt::format(" {} ({})", value.name(), names);
  }
  template <typename T>
  requires std::is_class_v<T> &&(!NamedValue<T>)static std::string default_of(const T&) { return ""; }
  template <typename... T>
  static std::string default_of(const std::variant<T...>&) {
    return "";
  }

  static std::string range_of(const About& about) {
    if (!std::isfinite(about.min) || !std::isfinite(about.max)) return "";
    return fmt::format(" ({}{} to {})", about.above_min ? "> " : "", about.min, about.max);
  }

  template <typename T>
  void nested(T&) {}
  template <typename T>
  requires requires(ReferenceWriter writer, T options) { describe(writer, options); }
  void nested(T& options) {
    ReferenceWriter inner(out_, depth_ + 1);
    describe(inner, options);
  }
  template <typename T>
  void nested(std::optional<T>&) {
    T value{};
    nested(value);
  }
  template <typename T>
  void nested(std::vector<T>&) {
    T entry;
    nested(entry);
  }
  void nested(std::vector<SensorOptions>&) {}  // as event_camera
  template <typename... T>
  void nested(std::variant<T...>&) {
    (alternative<T>(), ...);
  }
  template <typename T>
  void alternative() {
    T options;
    ReferenceWriter inner(out_, depth_ + 1);
    inner.line(fmt::format("type: {}", T::kType), "");
    ReferenceWriter members(out_, depth_ + 2);
    describe(members, options);
  }

  std::string& out_;
  int depth_;
};

}  // namespace

std::string write_scenario(const Scenario& scenario) {
  YAML::Emitter out;
  YamlWriter writer(out);
  out << YAML::BeginMap;
  Scenario copy = scenario;
  describe(writer, copy);
  out << YAML::Key << "cameras" << YAML::Value << YAML::BeginSeq;
  for (CameraOptions camera : scenario.cameras) {
    out << YAML::BeginMap;
    describe(writer, camera);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

namespace {

/// One option of a scenario with all its members.
template <typename Options>
std::string write_option(const Options& options) {
  YAML::Emitter out;
  YamlWriter writer(out);
  out << YAML::BeginMap;
  writer("option", options, About{});
  out << YAML::EndMap;
  return YAML::Dump(YAML::Load(out.c_str())["option"]);
}

}  // namespace

std::string write_sampling(const SamplingOptions& options) { return write_option(options); }

std::string write_event_camera(const EventCameraOptions& options) { return write_option(options); }

std::string write_conversion(const ConversionOptions& options) {
  YAML::Emitter out;
  YamlWriter writer(out);
  out << YAML::BeginMap;
  ConversionOptions copy = options;
  describe(writer, copy);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

std::string scenario_reference() {
  std::string out;
  ReferenceWriter writer(out);
  Scenario scenario;
  describe(writer, scenario);
  CameraOptions camera;
  out += "cameras: a list of maps (or camera: a single map) of\n";
  ReferenceWriter inner(out, 1);
  describe(inner, camera);
  return out;
}

}  // namespace esim::inline scenario
