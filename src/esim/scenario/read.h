#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/scenario/scenario.h"

namespace esim {

/// Reads a scenario from a YAML file. Relative paths in it are taken from the file's folder, and ${NAME} stands for an
/// environment variable.
///
/// Cameras are a list under `cameras`, or a single one under `camera` (default: one camera of default values); the keys
/// `sampling`, `event_camera` and `frame_camera` at the top hold for every camera that does not set them itself. A
/// camera's calibration file is read here: the result holds explicit geometry only.
///
/// `overrides` are "dotted.key=value" and come last. Throws UserError, most often an OptionError, with file, line, key,
/// and what would be right.
Scenario read_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

/// What is wrong with one option of a scenario. The message has the file and the line too.
class OptionError : public UserError {
 public:
  OptionError(const std::string& message, std::string key, std::string problem)
      : UserError(message), key_(std::move(key)), problem_(std::move(problem)) {}

  const std::string& key() const { return key_; }          ///< dotted
  const std::string& problem() const { return problem_; }  ///< without the file and the key

 private:
  std::string key_, problem_;
};

/// What messages about overrides begin with, unless told otherwise: they are options of a command.
inline constexpr const char* kSetter = "--set ";

/// A scenario that a program has put together.
struct ScenarioText {
  std::string yaml;
  std::filesystem::path file;  ///< names it in messages; relative paths are taken from its folder; it need not exist
  bool has_lines = true;       ///< messages name the lines of `yaml`
  std::vector<std::string> overrides;
  std::string setter = kSetter;  ///< what messages about overrides begin with
  bool needs_renderer = true;    ///< false: whoever simulates it brings its own, and the key may be missing
  bool needs_trajectory = true;  ///< likewise
  bool needs_waypoints = true;   ///< false: a file of way points may be missing, since it is yet to be written

  /// Where set: told of every file that the text names, before it is read; what it returns, if anything, is what is
  /// wrong with naming it.
  std::function<std::string(const std::filesystem::path& file)> refuses{};
};

/// The same from text.
Scenario read_scenario(const ScenarioText& text);

/// The same from a file, whose text and name replace those of `otherwise`.
Scenario read_scenario(const std::filesystem::path& file, ScenarioText otherwise);

/// The scenario in full, every option explicit, as YAML: reading it back gives the same scenario.
std::string write_scenario(const Scenario& scenario);

/// A way of sampling in full, as YAML.
std::string write_sampling(const SamplingOptions& options);

/// Every option with type, default, unit, range and help, as text for a person.
std::string scenario_reference();

/// The geometry that `options` describe. Throws UserError where it is impossible.
Camera camera_model(const CameraOptions& options);

}  // namespace esim
