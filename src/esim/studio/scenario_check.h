#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "esim/scenario/scenario.h"
#include "esim/studio/json.h"
#include "esim/studio/roots.h"

namespace esim::studio {

/// What a text says, and what is wrong with it.
struct CheckedScenario {
  Json values;                       ///< the options that it gives
  Json problems = Json::array();     ///< [{where, what}]: as many as can be told at once
  std::optional<Scenario> scenario;  ///< without the options that are problems; nothing where even that cannot be had
};

/// Checks a scenario; `file` names it, and its folder is where relative paths begin. Files outside the roots are
/// problems, and not read. Throws UserError for what is no YAML.
CheckedScenario check_scenario(const std::string& yaml, const std::filesystem::path& file, const Roots& roots);

/// What has to be right: the renderer and the cameras, or the motion as well.
enum class ScenarioNeeds { scene, motion };

/// The scenario of a request, {yaml, dir}, which may have problems elsewhere. Throws UserError: the first problem of
/// what is needed.
Scenario scenario_of(const Json& request, const Roots& roots, ScenarioNeeds needs);

/// The place that a request's text stands for: a file in its `dir`, which need not exist.
std::filesystem::path place_of(const Json& request, const Roots& roots);

/// The option that a message begins with, as in "duration_s: is missing"; empty where it begins with none.
std::string option_in(const std::string& message);

}  // namespace esim::studio
