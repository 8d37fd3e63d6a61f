#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "esim/scenario/variation/distribution.h"

namespace esim::inline dataset {

/// An option of a scenario, by its dotted key, and its distribution.
struct RandomOption {
  std::string key{};
  Distribution distribution{};
  std::string yaml{};  ///< of the distribution
};

/// A random value as YAML. Depends on the seed, the number of the sequence and the option only.
std::string draw(const Distribution& distribution, std::uint64_t seed, std::uint32_t sequence, std::uint16_t option);

/// A scenario with random options.
struct ScenarioTemplate {
  std::string yaml{};                   ///< without `randomise`
  std::vector<RandomOption> options{};  ///< in the order of the file
};

/// Reads the text of a scenario with the key
///     randomise:
///       event_camera.contrast_threshold: {uniform: [0.1, 0.5]}
///       camera.width: {integer: [100, 300]}
///       renderer.image: {choice: [a.png, b.png]}
/// and likewise log_uniform: [LOW, HIGH] and normal: [MEAN, DEVIATION]. Throws UserError with `name`, the key and the
/// valid values. Unknown keys are reported later, when a scenario is read.
ScenarioTemplate read_template(const std::string& text, const std::string& name);

}  // namespace esim::inline dataset
