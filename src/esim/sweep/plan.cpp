#include "esim/sweep/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/files/folder_plan.h"
#include "esim/files/number_text.h"
#include "esim/scenario/read.h"

namespace esim::inline sweep {
namespace {

namespace fs = std::filesystem;

/// Maximum number of event sensors behind a lens: their memory is limited, and rendering is shared well enough.
constexpr std::size_t kMaxShared = 64;

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

/// Splits at the commas outside of brackets and quotes.
std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  char quote = '\0';
  for (const char c : text) {
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    }
    if (c == ',' && depth == 0 && quote == '\0') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  std::ranges::transform(parts, parts.begin(), trimmed);
  return parts;
}

/// Appends the values that a word stands for: itself, or those of a range. `fail` throws.
template <typename Fail>
void append_values(const std::string& word, std::uint64_t max_values, const Fail& fail,
                   std::vector<std::string>& values) {
  const std::size_t dots = word.find("..");
  double low = 0, high = 0;
  if (dots == std::string::npos || !parse_number(word.substr(0, dots), low) ||
      !parse_number(word.substr(dots + 2), high)) {
    values.push_back(word);
    return;
  }
  std::int64_t first = 0, last = 0;
  if (!parse_number(word.substr(0, dots), first) || !parse_number(word.substr(dots + 2), last))
    fail(fmt::format("'{}': a range must be of whole numbers, as in 1..5; list the values instead", word));
  if (first > last) fail(fmt::format("'{}': the range is reversed; write {}..{}", word, last, first));
  const std::uint64_t steps = static_cast<std::uint64_t>(last) - static_cast<std::uint64_t>(first);
  if (steps >= max_values) {
    fail(fmt::format("'{}': the range has more than {} values, which is the maximum number of runs", word,
                     grouped(max_values)));
  }
  for (std::uint64_t i = 0; i <= steps; ++i) values.push_back(std::to_string(first + static_cast<std::int64_t>(i)));
}

/// What runs must have in common to share a simulation.
struct Common {
  std::string seen{};     // everything but the event sensors
  std::string samples{};  // what the samples depend on of these
};

Common common_of(Scenario scenario) {
  Common common;
  for (const CameraOptions& camera : scenario.cameras) {
    if (sampling_depends_on_sensors(camera)) {
      const SensorTraits traits = strictest_sensor(scenario, camera);
      common.samples += fmt::format("sampling {} {}\n", traits.contrast_threshold, traits.log_eps);
    }
    if (flickers(scenario)) {
      const LightAccuracy accuracy = light_accuracy(camera);
      common.samples += fmt::format("light {} {}\n", accuracy.tolerance, accuracy.dark);
    }
  }
  for (CameraOptions& camera : scenario.cameras) {
    camera.event_camera = {};
    camera.event_cameras.clear();
  }
  if (!seed_determines_more_than_events(scenario)) scenario.seed = 0;
  common.seen = write_scenario(scenario);
  return common;
}

/// The largest number of event sensors behind one lens.
std::size_t most_sensors(const Scenario& scenario) {
  std::size_t most = 0;
  for (const CameraOptions& camera : scenario.cameras) most = std::max(most, camera.sensors().size());
  return most;
}

/// Runs that share a simulation, while they are collected.
struct Group {
  std::vector<std::size_t> runs;
  std::vector<Scenario> scenarios;
  std::size_t sensors = 0;  // of a camera
};

/// The simulation of a run alone.
SweptSimulation simulation_of(std::size_t run, Scenario scenario) {
  SweptSimulation simulation{.scenario = std::move(scenario), .runs = {run}};
  for (const CameraOptions& camera : simulation.scenario.cameras) {
    for (const SensorOptions& sensor : camera.sensors()) {
      const fs::path folder = camera.name;
      simulation.events.push_back({run, sensor.name.empty() ? folder : folder / sensor.name});
    }
  }
  return simulation;
}

/// The simulation of several runs: all their event sensors behind the same lenses.
SweptSimulation simulation_of(const Group& group, const SweepPlan& plan) {
  SweptSimulation simulation{.scenario = group.scenarios.front(), .runs = group.runs};
  for (CameraOptions& camera : simulation.scenario.cameras) camera.event_cameras.clear();
  for (std::size_t i = 0; i < group.runs.size(); ++i) {
    const std::size_t run = group.runs[i];
    for (std::size_t c = 0; c < group.scenarios[i].cameras.size(); ++c) {
      CameraOptions& camera = simulation.scenario.cameras[c];
      for (SensorOptions sensor : group.scenarios[i].cameras[c].sensors()) {
        sensor.name = fmt::format("run{:04}{}{}", run, sensor.name.empty() ? "" : "_", sensor.name);
        sensor.seed = sensor.seed.value_or(group.scenarios[i].seed);
        for (std::size_t k = 0; k < plan.over.size(); ++k)
          sensor.varied.push_back({plan.over[k].key, plan.runs[run][k]});
        simulation.events.push_back({run, fs::path(camera.name) / sensor.name});
        camera.event_cameras.push_back(std::move(sensor));
      }
    }
  }
  return simulation;
}

/// Throws UserError if an option is given twice, or as a part of one that replaces it afterwards.
void check_keys(const SweepOptions& options) {
  std::vector<std::string> before;
  for (const std::string& text : options.overrides) before.push_back(text.substr(0, text.find('=')));
  for (const SweptOption& option : options.over) {
    const auto fail = [&](const std::string& problem) {
      throw UserError(fmt::format("{}{}: {}", options.setter, option.key, problem));
    };
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (before[i] == option.key)
        fail(i < options.overrides.size() ? "is also set for all runs; remove one of them"
                                          : "is given twice; list all its values once");
      if (before[i].starts_with(option.key + "."))
        fail(fmt::format("replaces {}, which is given before it; give it first, or remove one of them", before[i]));
    }
    before.push_back(option.key);
  }
}

std::string arguments_json(const SweepOptions& options, const std::string& version) {
  using Json = nlohmann::ordered_json;
  Json over = Json::object(), order = Json::array();
  for (const SweptOption& option : options.over) {
    over[option.key] = option.values;
    order.push_back(option.key);
  }
  const Json arguments{
      {"esim", version},          {"scenario", fs::absolute(options.scenario).lexically_normal().string()},
      {"set", options.overrides}, {"over", over},
      {"order", order},           {"text", read_text(options.scenario).value_or("")}};
  return arguments.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

SweptOption read_swept_option(const std::string& text, std::uint64_t max_values, const std::string& setter) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw UserError(fmt::format("{}{}: must be KEY=VALUE,VALUE,... or KEY=FIRST..LAST", setter, text));
  SweptOption option{trimmed(text.substr(0, equals)), {}};
  const auto fail = [&](const std::string& problem) {
    throw UserError(fmt::format("{}{}: {}", setter, option.key, problem));
  };
  const std::vector<std::string> words = split(text.substr(equals + 1));
  if (words.size() == 1 && words.front().empty()) fail("has no values; list them, as in 0.1,0.2 or 1..5");
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].empty()) fail(fmt::format("value {} is empty; remove a comma", i + 1));
    append_values(words[i], max_values, fail, option.values);
  }
  std::set<std::string> distinct;
  for (const std::string& value : option.values) {
    if (!distinct.insert(value).second) fail(fmt::format("the value {} is given twice; remove one", value));
  }
  return option;
}

std::uint64_t number_of_runs(const std::vector<SweptOption>& over) {
  std::uint64_t runs = 1;
  for (const SweptOption& option : over) {
    if (__builtin_mul_overflow(runs, option.values.size(), &runs)) return UINT64_MAX;
  }
  return runs;
}

SweepPlan plan_sweep(const SweepOptions& options, const std::string& version) {
  check_keys(options);
  read_scenario(options.scenario, options.overrides);  // so that messages about these name them
  SweepPlan plan{.over = options.over, .json = arguments_json(options, version)};
  std::vector<Group> groups;
  std::map<std::string, std::size_t> open;  // the latest group by what its runs have in common
  std::set<std::string> seen;
  const std::size_t runs = number_of_runs(options.over);
  for (std::size_t run = 0; run < runs; ++run) {
    std::vector<std::string>& values = plan.runs.emplace_back();
    ScenarioText text;
    text.overrides = options.overrides;
    text.setter = options.setter;
    std::size_t place = run, places = runs;
    for (const SweptOption& option : options.over) {
      places /= option.values.size();
      values.push_back(option.values[place / places]);
      place %= places;
      text.overrides.push_back(option.key + "=" + values.back());
    }
    Scenario scenario = read_scenario(options.scenario, text);
    const std::size_t sensors = most_sensors(scenario);
    if (sensors == 0) {
      throw UserError(fmt::format("{}: no camera has an event sensor{}; remove events: false",
                                  options.scenario.string(), plan.over.empty() ? "" : " with " + values_of(plan, run)));
    }
    const Common common = common_of(scenario);
    seen.insert(common.seen);
    const auto [found, added] = open.try_emplace(common.seen + common.samples, groups.size());
    if (added || groups[found->second].sensors + sensors > kMaxShared) {
      found->second = groups.size();
      groups.emplace_back();
    }
    Group& group = groups[found->second];
    group.runs.push_back(run);
    group.scenarios.push_back(std::move(scenario));
    group.sensors += sensors;
  }
  plan.separated_by_samples = open.size() > seen.size();
  for (Group& group : groups) {
    plan.simulations.push_back(group.runs.size() == 1
                                   ? simulation_of(group.runs.front(), std::move(group.scenarios.front()))
                                   : simulation_of(group, plan));
    plan.simulations.back().name = fmt::format("simulation{:04}", plan.simulations.size() - 1);
  }
  return plan;
}

std::string values_of(const SweepPlan& plan, std::size_t run) {
  std::string text;
  for (std::size_t k = 0; k < plan.over.size(); ++k)
    text += fmt::format("{}{}={}", k == 0 ? "" : ", ", plan.over[k].key, plan.runs[run][k]);
  return text;
}

}  // namespace esim::inline sweep
