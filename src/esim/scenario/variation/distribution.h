#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "esim/core/random.h"

namespace esim::inline scenario {

// Distributions of values.
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

/// Whether the name is that of a distribution, such as "uniform".
bool is_distribution(const std::string& name);

/// The distribution that a map describes, given as YAML: {uniform: [LOW, HIGH]}, {log_uniform: [LOW, HIGH]},
/// {integer: [LOW, HIGH]}, {normal: [MEAN, DEVIATION]} or {choice: [VALUE, ...]}. Throws UserError with the problem and
/// the valid values; the caller adds the place.
Distribution read_distribution(const std::string& yaml);

/// A random value as YAML: a function of the random numbers and the item.
std::string draw(const Distribution& distribution, const AddressedRandom& random, std::uint32_t item);

}  // namespace esim::inline scenario
