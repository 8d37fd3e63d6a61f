#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "esim/scenario/scenario.h"

/// A scenario with every combination of values of some options.
namespace esim::inline sweep {

/// An option of a scenario, by its dotted key, and its values, as YAML.
struct SweptOption {
  std::string key{};
  std::vector<std::string> values{};
};

/// Reads "KEY=VALUE,VALUE,...", where FIRST..LAST stands for whole numbers. Commas in brackets and in quotes belong to
/// a value. Throws UserError, which begins with `setter`, also for more than `max_values` values.
SweptOption read_swept_option(const std::string& text, std::uint64_t max_values, const std::string& setter);

/// The number of combinations; at most 2^64 - 1.
std::uint64_t number_of_runs(const std::vector<SweptOption>& over);

struct SweepOptions {
  std::filesystem::path scenario{};
  std::vector<std::string> overrides{};  ///< "key=value", of all runs
  std::vector<SweptOption> over{};
  std::string setter{};  ///< beginning of messages about `over`
};

/// The events of an event sensor in a run.
struct SweptEvents {
  std::size_t run = 0;
  std::filesystem::path folder{};  ///< in that of the simulation
};

/// A simulation of one run, or of several runs whose event sensors see the same.
struct SweptSimulation {
  std::string name{};
  Scenario scenario{};
  std::vector<std::size_t> runs{};
  std::vector<SweptEvents> events{};  ///< in the order of the runs
};

struct SweepPlan {
  std::vector<SweptOption> over{};
  std::vector<std::vector<std::string>> runs{};  ///< the values of each; those of the last option change first
  std::vector<SweptSimulation> simulations{};    ///< in the order of their first runs
  std::string json{};                            ///< the arguments

  /// Whether runs that differ only in their event sensors are simulated separately, since their samples depend on
  /// these.
  bool separated_by_samples = false;
};

/// Runs share a simulation if only their event sensors differ, and if each then has exactly the events that it has
/// alone. Throws UserError for invalid options.
SweepPlan plan_sweep(const SweepOptions& options, const std::string& version);

/// The values of a run: "seed=1, duration_s=2".
std::string values_of(const SweepPlan& plan, std::size_t run);

}  // namespace esim::inline sweep
