#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace esim {

// How a value is drawn.
struct Uniform {
  double low = 0, high = 0;
};
struct LogUniform {
  double low = 0, high = 0;  ///< above 0
};
struct Normal {
  double mean = 0, deviation = 0;
};
struct WholeNumber {
  std::int64_t low = 0, high = 0;  ///< both included
};
struct Choice {
  std::vector<std::string> values{};  ///< as YAML
};
using Distribution = std::variant<Uniform, LogUniform, Normal, WholeNumber, Choice>;

/// An option of a scenario by its dotted key, and what it is drawn from.
struct RandomOption {
  std::string key{};
  Distribution distribution{};
};

/// A value as YAML: a function of the seed, the number of the sequence, and which option it is for.
std::string draw(const Distribution& distribution, std::uint64_t seed, std::uint32_t sequence, std::uint16_t option);

/// A scenario of which some options are drawn.
struct ScenarioTemplate {
  std::string yaml{};                   ///< without `randomise`
  std::vector<RandomOption> options{};  ///< in the order of the file
};

/// Reads the text of a scenario with the key
///     randomise:
///       event_camera.contrast_threshold: {uniform: [0.1, 0.5]}
///       camera.width: {integer: [100, 300]}
///       renderer.image: {choice: [a.png, b.png]}
/// and log_uniform: [LOW, HIGH] and normal: [MEAN, DEVIATION] likewise. Throws UserError naming `name`, the key and
/// what would be right; whether the keys are options of a scenario shows when one is read.
ScenarioTemplate read_template(const std::string& text, const std::string& name);

}  // namespace esim
