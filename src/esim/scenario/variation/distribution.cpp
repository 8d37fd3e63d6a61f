#include "esim/scenario/variation/distribution.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "esim/core/error.h"

namespace esim::inline scenario {
namespace {

constexpr std::array<const char*, 5> kNames{"uniform", "log_uniform", "normal", "integer", "choice"};
constexpr const char* kKinds = "uniform, log_uniform, normal, integer or choice";

template <typename Number>
std::pair<Number, Number> two_numbers(const YAML::Node& value, const char* names) {
  try {
    if (value.IsSequence() && value.size() == 2) {
      const std::pair<Number, Number> numbers{value[0].as<Number>(), value[1].as<Number>()};
      if (std::isfinite(static_cast<double>(numbers.first)) && std::isfinite(static_cast<double>(numbers.second)))
        return numbers;
    }
  } catch (const YAML::Exception&) {  // as below
  }
  throw UserError(fmt::format("must be a list of two numbers, {}", names));
}

/// Reads LOW and HIGH, LOW first.
template <typename Number>
std::pair<Number, Number> range(const YAML::Node& value, Number min) {
  const auto [low, high] = two_numbers<Number>(value, "[LOW, HIGH]");
  if (low > high) throw UserError(fmt::format("LOW is {}, but must be at most HIGH, {}; swap them", low, high));
  if (low < min) throw UserError(fmt::format("LOW is {}, but must be at least {}", low, min));
  return {low, high};
}

}  // namespace

bool is_distribution(const std::string& name) { return std::ranges::find(kNames, name) != kNames.end(); }

Distribution read_distribution(const std::string& yaml) {
  const YAML::Node node = YAML::Load(yaml);
  if (!node.IsMap() || node.size() != 1)
    throw UserError(fmt::format("must be a map with one key of {}, as in {{uniform: [0.1, 0.5]}}", kKinds));
  const std::string kind = node.begin()->first.Scalar();
  const YAML::Node value = node.begin()->second;
  constexpr double kLowest = std::numeric_limits<double>::lowest();
  if (kind == "uniform") {
    const auto [low, high] = range(value, kLowest);
    return Uniform{low, high};
  }
  if (kind == "log_uniform") {
    const auto [low, high] = range(value, std::numeric_limits<double>::min());
    return LogUniform{low, high};
  }
  if (kind == "normal") {
    const auto [mean, deviation] = two_numbers<double>(value, "[MEAN, DEVIATION]");
    if (deviation < 0) throw UserError(fmt::format("DEVIATION is {}, but must be at least 0", deviation));
    return Normal{mean, deviation};
  }
  if (kind == "integer") {
    const auto [low, high] = range<std::int64_t>(value, -(std::int64_t{1} << 53));
    if (high - low >= std::int64_t{1} << 53) throw UserError("the range must be smaller than 2^53");
    return WholeNumber{low, high};
  }
  if (kind == "choice") {
    if (!value.IsSequence() || value.size() == 0) throw UserError("must be a list of at least one value");
    Choice choice;
    for (const YAML::Node& each : value) {
      YAML::Emitter text;
      text << YAML::Flow << each;
      choice.values.emplace_back(text.c_str());
    }
    return choice;
  }
  throw UserError(fmt::format("unknown distribution '{}'; use {}", kind, kKinds));
}

std::string draw(const Distribution& distribution, const AddressedRandom& random, std::uint32_t item) {
  const double u = random.uniforms(item)[0];
  const auto whole = [u](std::int64_t values) { return static_cast<std::int64_t>(u * static_cast<double>(values)); };
  struct Draw {
    const AddressedRandom& random;
    std::uint32_t item;
    double u;
    const decltype(whole)& pick;
    std::string operator()(const Uniform& d) const { return fmt::format("{}", d.low + u * (d.high - d.low)); }
    std::string operator()(const LogUniform& d) const {
      return fmt::format("{}", std::clamp(d.low * std::pow(d.high / d.low, u), d.low, d.high));
    }
    std::string operator()(const Normal& d) const {
      return fmt::format("{}", d.mean + d.deviation * random.normals(item)[0]);
    }
    std::string operator()(const WholeNumber& d) const { return std::to_string(d.low + pick(d.high - d.low + 1)); }
    std::string operator()(const Choice& d) const {
      return d.values[static_cast<std::size_t>(pick(static_cast<std::int64_t>(d.values.size())))];
    }
  };
  return std::visit(Draw{random, item, u, whole}, distribution);
}

}  // namespace esim::inline scenario
