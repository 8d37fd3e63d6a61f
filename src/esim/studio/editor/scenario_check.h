#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "esim/scenario/scenario.h"
#include "esim/studio/roots.h"
#include "esim/studio/server/json.h"

// Private to studio.
namespace esim::studio {

/// The contents of a scenario's text, and its problems.
struct CheckedScenario {
  Json values;                       ///< the given options
  Json problems = Json::array();     ///< [{where, what, line}]: all that can be found at once
  std::optional<Scenario> scenario;  ///< without the invalid options; empty if it still cannot be read
};

/// Checks a scenario; `file` is its name, and relative paths start at its folder. Files outside the roots are problems
/// and are not read. Throws UserError for invalid YAML.
CheckedScenario check_scenario(const std::string& yaml, const std::filesystem::path& file, const Roots& roots);

/// A problem of an option, at a line of the text from 1; 0: it has no line.
Json problem_json(const std::string& where, const std::string& what, int line);

/// The parts that must be valid: the renderer and the cameras, or also the motion.
enum class ScenarioNeeds { scene, motion };

/// The scenario of a request, {yaml, dir}. Throws UserError with the first problem of the needed parts; other parts may
/// have problems.
Scenario scenario_of(const Json& request, const Roots& roots, ScenarioNeeds needs);

/// The place of a request's text: a file in its `dir`, which need not exist.
std::filesystem::path place_of(const Json& request, const Roots& roots);

/// The option at the beginning of a message, as in "duration_s: is missing"; empty without one.
std::string option_in(const std::string& message);

}  // namespace esim::studio
