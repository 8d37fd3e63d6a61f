#include "esim/studio/editor/scenario_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "esim/scenario/read.h"
#include "esim/scenario/schema.h"
#include "esim/studio/editor/scenario_values.h"
#include "esim/studio/server/http.h"

namespace esim::studio {
namespace {

namespace fs = std::filesystem;

/// A visitor of describe() that calls a function for every file in the options.
class FileVisitor {
 public:
  using See = std::function<void(const fs::path&)>;
  explicit FileVisitor(const See& see) : see_(see) {}

  template <typename T>
  void operator()(const char*, T& value, const About&) {
    look(value);
  }

 private:
  void look(const fs::path& path) {
    if (!path.empty()) see_(path);
  }
  void look(VertexFile& vertices) {
    for (const fs::path& file : files_if_complete(vertices)) look(file);
  }
  template <typename T>
  void look(T&) {}
  template <typename T>
  requires requires(FileVisitor visitor, T options) { describe(visitor, options); }
  void look(T& options) { describe(*this, options); }
  template <typename T>
  void look(std::optional<T>& value) {
    if (value) look(*value);
  }
  template <typename T>
  void look(std::vector<T>& values) {
    for (T& value : values) look(value);
  }
  template <typename... T>
  void look(std::variant<T...>& value) {
    std::visit([&](auto& alternative) { describe(*this, alternative); }, value);
  }

  const See& see_;
};

std::string outside(const fs::path& file) {
  return fmt::format("{} must be in one of the folders that are open; start esim studio with --root {}", file.string(),
                     file.parent_path().string());
}

/// Files that are named in other files of the scenario.
void refuse_foreign_files(Scenario& scenario, const Roots& roots) {
  FileVisitor visitor([&](const fs::path& file) {
    if (!roots.contains(file)) throw UserError(outside(file));
  });
  describe(visitor, scenario);
}

/// The place of an option, whose key is dotted, in the values: a JSON pointer.
Json::json_pointer pointer_of(const std::string& key) {
  Json::json_pointer pointer;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    pointer /= key.substr(begin, end - begin);
    begin = end + 1;
  }
  return pointer;
}

bool has(const Json& values, const std::string& key) { return values.contains(pointer_of(key)); }

void remove(Json& values, const std::string& key) {
  const Json::json_pointer pointer = pointer_of(key);
  Json& parent = values[pointer.parent_pointer()];
  if (parent.is_array()) {
    parent.erase(std::stoul(pointer.back()));
  } else {
    parent.erase(pointer.back());
  }
}

/// The key in the text of an option that all cameras share; the reader reports it with a camera's key.
std::string place_in(const Json& values, const std::string& key) {
  if (has(values, key)) return key;
  for (const char* shared : {"event_camera", "frame_camera", "sampling"}) {
    const std::size_t at = key.find(std::string(".") + shared);
    if (key.starts_with("camera") && at != std::string::npos && has(values, key.substr(at + 1)))
      return key.substr(at + 1);
  }
  return "";
}

}  // namespace

Json problem_json(const std::string& where, const std::string& what, int line) {
  Json problem{{"where", where}, {"what", what}};
  if (line > 0) problem["line"] = line;
  return problem;
}

std::string option_in(const std::string& message) {
  const std::size_t end = message.find(": ");
  if (end == std::string::npos || end == 0) return "";
  const std::string word = message.substr(0, end);
  const bool option = word.find_first_not_of("abcdefghijklmnopqrstuvwxyzT_.0123456789") == std::string::npos;
  return option && std::isalpha(static_cast<unsigned char>(word.front())) != 0 ? word : "";
}

CheckedScenario check_scenario(const std::string& yaml, const fs::path& file, const Roots& roots) {
  constexpr int kMaxProblems = 20;
  CheckedScenario checked;
  checked.values = values_of(yaml, file.filename().string());
  Json remaining = checked.values;
  ScenarioText text;
  text.yaml = yaml;
  text.file = file;
  text.needs_waypoints = false;
  text.refuses = [&](const fs::path& named) { return roots.contains(named) ? "" : outside(named); };
  const auto note = [&](const std::string& where, const std::string& what, int line) {
    for (const Json& problem : checked.problems) {
      if (problem["where"] == where) return;  // it is missing because of the removal below
    }
    checked.problems.push_back(problem_json(where, what, line));
  };
  for (int i = 0; i < kMaxProblems; ++i) {
    try {
      Scenario scenario = read_scenario(text);
      refuse_foreign_files(scenario, roots);
      checked.scenario = std::move(scenario);
      return checked;
    } catch (const OptionError& error) {
      // Remove the invalid option to find the next problem.
      const std::string place = place_in(remaining, error.key());
      note(place.empty() ? error.key() : place, error.problem(), error.line());
      if (!place.empty()) {
        text.removed.push_back(place);
        remove(remaining, place);
      } else if (error.key() == "renderer") {
        text.needs_renderer = false;
      } else if (error.key() == "trajectory") {
        text.needs_trajectory = false;
      } else {
        return checked;
      }
    } catch (const UserError& error) {
      note(option_in(error.what()), error.what(), 0);
      return checked;
    }
  }
  return checked;
}

fs::path place_of(const Json& request, const Roots& roots) {
  const std::string dir = text_member(request, "dir", roots.list().front().name);
  return roots.existing(dir) / "scenario.yaml";
}

Scenario scenario_of(const Json& request, const Roots& roots, ScenarioNeeds needs) {
  CheckedScenario checked = check_scenario(text_member(request, "yaml"), place_of(request, roots), roots);
  static const std::set<std::string> kScene{"renderer", "camera", "cameras"};
  static const std::set<std::string> kMotion{"trajectory", "start_s", "duration_s", "seed"};
  for (const Json& problem : checked.problems) {
    const std::string where = problem["where"], what = problem["what"];
    const std::string first = where.substr(0, where.find('.'));
    const bool of_sensor =
        where.find(".event_camera") != std::string::npos || where.find(".frame_camera") != std::string::npos;
    const bool matters =
        (kScene.contains(first) && !of_sensor) || (needs == ScenarioNeeds::motion && kMotion.contains(first));
    if (matters || !checked.scenario)
      throw OptionError(where.empty() || option_in(what) == where ? what : where + ": " + what, where, what);
  }
  return *std::move(checked.scenario);
}

}  // namespace esim::studio
