#include "esim/studio/editor/schema_json.h"

#include <fmt/format.h>

#include <cmath>

#include "esim/core/named_value.h"
#include "esim/event_camera/options.h"
#include "esim/scenario/schema.h"

namespace esim::studio {
namespace {

/// A visitor of describe() that lists the members.
class SchemaWriter {
 public:
  explicit SchemaWriter(Json& members) : members_(members) {}

  template <typename T>
  void operator()(const char* name, T& value, const About& about) {
    Json entry{{"name", name}};
    fill(value, entry);
    entry["help"] = about.help;
    if (*about.unit != '\0') entry["unit"] = about.unit;
    if (std::isfinite(about.min)) entry["low"] = about.min;
    if (std::isfinite(about.max)) entry["high"] = about.max;
    if (about.above_min) entry["positive"] = true;
    members_.push_back(std::move(entry));
  }

 private:
  /// Eigen leaves a new vector uninitialised.
  template <typename T>
  static T initial_value() {
    if constexpr (requires { T::Zero(); }) {
      return T::Zero();
    } else {
      return T{};
    }
  }

  static void leaf(Json& entry, const char* kind, Json value) {
    entry["kind"] = kind;
    entry["default"] = std::move(value);
  }

  static void fill(bool value, Json& entry) { leaf(entry, "boolean", value); }
  static void fill(int value, Json& entry) { leaf(entry, "integer", value); }
  static void fill(std::uint64_t value, Json& entry) { leaf(entry, "integer", value); }
  static void fill(double value, Json& entry) { leaf(entry, "number", value); }
  static void fill(const std::string& value, Json& entry) { leaf(entry, "text", value); }
  static void fill(const std::filesystem::path& value, Json& entry) { leaf(entry, "path", value.string()); }

  template <int N>
  static void fill(const Eigen::Matrix<double, N, 1>& value, Json& entry) {
    leaf(entry, "vector", std::vector<double>(value.data(), value.data() + N));
    entry["size"] = N;
  }

  template <typename T>
  static void fill(std::optional<T>&, Json& entry) {
    T value = initial_value<T>();
    fill(value, entry);
    entry["optional"] = true;
    entry["default"] = nullptr;
  }

  template <typename T>
  static void fill(std::vector<T>&, Json& entry) {
    entry["kind"] = "list";
    T value = initial_value<T>();
    fill(value, entry["element"]);
  }

  template <typename T>
  requires std::is_enum_v<T>
  static void fill(T value, Json& entry) {
    leaf(entry, "choice", kEnumNames<T>[static_cast<std::size_t>(value)]);
    for (const char* name : kEnumNames<T>) entry["choices"].push_back(name);
  }

  template <NamedValue T>
  static void fill(const T& value, Json& entry) {
    leaf(entry, "choice", value.name());
    entry["choices"] = T::names();
  }

  template <typename T>
  requires requires(SchemaWriter writer, T options) { describe(writer, options); }
  static void fill(T& value, Json& entry) {
    entry["kind"] = "group";
    SchemaWriter inner(entry["members"] = Json::array());
    describe(inner, value);
  }

  template <typename... T>
  static void fill(std::variant<T...>& value, Json& entry) {
    entry["kind"] = "variant";
    entry["tag"] = "type";
    (alternative<T>(entry["options"]), ...);
    Json name = entry["options"][value.index()]["name"];
    entry["default"] = std::move(name);
  }

  template <typename T>
  static void alternative(Json& options) {
    T value;
    Json option{{"name", T::kType}, {"members", Json::array()}};
    SchemaWriter inner(option["members"]);
    describe(inner, value);
    options.push_back(std::move(option));
  }

  Json& members_;
};

/// A visitor of describe() that collects the values.
class ValueWriter {
 public:
  explicit ValueWriter(Json& values) : values_(values) {}

  template <typename T>
  void operator()(const char* name, T& value, const About&) {
    if constexpr (std::is_arithmetic_v<T>) {
      values_[name] = value;
    } else if constexpr (std::is_enum_v<T>) {
      values_[name] = kEnumNames<T>[static_cast<std::size_t>(value)];
    } else if constexpr (NamedValue<T>) {
      values_[name] = value.name();
    } else if constexpr (requires { value.has_value(); }) {
      if (value) (*this)(name, *value, About{});
    } else if constexpr (requires(ValueWriter writer, T options) { describe(writer, options); }) {
      ValueWriter inner(values_[name] = Json::object());
      describe(inner, value);
    }
  }

 private:
  Json& values_;
};

}  // namespace

Json schema_json() {
  Json schema{{"kind", "group"}, {"name", "scenario"}, {"help", "all options of a simulation"}};
  SchemaWriter writer(schema["members"] = Json::array());
  Scenario scenario;
  describe(writer, scenario);
  // A scenario has one `camera` or a list of `cameras`; sampling, event_camera and frame_camera at its top apply to all
  // cameras.
  Json camera = Json::array();
  SchemaWriter inner(camera);
  CameraOptions options;
  describe(inner, options);
  for (const Json& member : camera) {
    const std::string name = member["name"];
    if (name == "sampling" || name == "event_camera" || name == "frame_camera") schema["members"].push_back(member);
  }
  schema["members"].push_back(
      {{"name", "camera"}, {"kind", "group"}, {"help", "the only camera of the rig"}, {"members", camera}});
  schema["members"].push_back({{"name", "cameras"},
                               {"kind", "list"},
                               {"help", "the cameras of the rig, instead of camera"},
                               {"element", {{"kind", "group"}, {"members", camera}}}});
  return schema;
}

Json presets_json() {
  Json presets = Json::array();
  for (const std::string& name : SensorPreset::names()) {
    EventCameraOptions options = preset_options(name);
    Json values = Json::object();
    ValueWriter writer(values);
    describe(writer, options);
    const std::string help = name == "ideal" ? "the paper's ideal pixel: no noise, no latency, unlimited bandwidth"
                             : options.circuit
                                 ? fmt::format("by the circuit: contrast threshold {}, photocurrent {} fA/lux",
                                               options.contrast_threshold, options.circuit->photocurrent_fa_per_lux)
                                 : fmt::format("contrast threshold {}, bandwidth {} Hz, latency {} us",
                                               options.contrast_threshold, options.low_pass_hz, options.latency_us);
    presets.push_back({{"name", name}, {"help", help}, {"values", values}});
  }
  return presets;
}

}  // namespace esim::studio
