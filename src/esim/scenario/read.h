#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "esim/core/error.h"
#include "esim/scenario/scenario.h"

namespace esim::inline scenario {

/// Reads a scenario from a YAML file. Relative paths in it start at the file's folder, and ${NAME} stands for an
/// environment variable.
///
/// Cameras are a list under `cameras`, or a single one under `camera` (default: one camera with default values). The
/// keys `sampling`, `event_camera` and `frame_camera` at the top apply to every camera that does not set them itself.
/// Calibration files are read here: the result has explicit geometry only.
///
/// Old names of options are valid and give a notice in the result.
///
/// `overrides` ("dotted.key=value") are applied last. Throws UserError, usually an OptionError, with file, line, key
/// and the valid values.
Scenario read_scenario(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

/// An invalid option of a scenario. The message also has the file and the line.
class OptionError : public UserError {
 public:
  OptionError(const std::string& message, std::string key, std::string problem, int line = 0)
      : UserError(message), key_(std::move(key)), problem_(std::move(problem)), line_(line) {}

  const std::string& key() const { return key_; }          ///< dotted
  const std::string& problem() const { return problem_; }  ///< without the file and the key
  int line() const { return line_; }                       ///< of the text, from 1; 0 if the option is not in it

 private:
  std::string key_, problem_;
  int line_;
};

/// The default beginning of messages about overrides, which are options of a command.
inline constexpr const char* kSetter = "--set ";

/// A scenario as text, with options for reading it.
struct ScenarioText {
  std::string yaml;
  std::filesystem::path file;             ///< for messages, and its folder for relative paths; it need not exist
  bool has_lines = true;                  ///< messages name the lines of `yaml`
  std::vector<std::string> removed = {};  ///< dotted keys of options of `yaml` that are not read, one after the other
  std::vector<std::string> overrides;
  std::string setter = kSetter;  ///< beginning of messages about overrides
  bool needs_renderer = true;    ///< false: the key may be missing, since the caller brings its own renderer
  bool needs_trajectory = true;  ///< false: the key may be missing, since the caller brings its own trajectory
  bool needs_waypoints = true;   ///< false: the file of waypoints may not exist yet

  /// If set, called for every file that the text names, before it is read. Returns why the file may not be used, or an
  /// empty text.
  std::function<std::string(const std::filesystem::path& file)> refuses{};
};

/// Reads a scenario from text.
Scenario read_scenario(const ScenarioText& text);

/// Reads a scenario from a file, whose text and name replace those of `otherwise`.
Scenario read_scenario(const std::filesystem::path& file, ScenarioText otherwise);

/// The scenario in full, every option explicit, as YAML: reading it back gives the same scenario.
std::string write_scenario(const Scenario& scenario);

/// A sampling method with all its options, as YAML.
std::string write_sampling(const SamplingOptions& options);

/// Every option with type, default, unit, range and help, as text for users.
std::string scenario_reference();

/// The options of an event sensor, in the light of the scenario unless the sensor has its own white_lux.
EventCameraOptions in_light_of(const Scenario& scenario, const EventCameraOptions& sensor);

/// Gives an event sensor the frames of the camera that shares its chip, unless it has its own frame_rate_hz or
/// frame_exposure_ms.
void add_frames(const std::optional<FrameCameraOptions>& frames, EventCameraOptions& sensor);

/// The geometry that `options` describe. Throws UserError if it is impossible.
Camera camera_model(const CameraOptions& options);

}  // namespace esim::inline scenario
