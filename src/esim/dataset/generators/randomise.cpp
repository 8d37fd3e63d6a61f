#include "esim/dataset/generators/randomise.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"
#include "esim/core/random.h"

namespace esim::inline dataset {
namespace {

constexpr const char* kKey = "randomise";

/// The place of a distribution in the file, for messages.
struct Place {
  std::string name;
  std::string key;
  YAML::Node node;

  [[noreturn]] void fail(const std::string& problem) const {
    const int line = node.Mark().line;
    throw UserError(fmt::format("{}:{}: {}.{}: {}", name, line + 1, kKey, key, problem));
  }
};

template <typename Number>
std::pair<Number, Number> two_numbers(const Place& place, const YAML::Node& value, const char* names) {
  try {
    if (value.IsSequence() && value.size() == 2) {
      const std::pair<Number, Number> numbers{value[0].as<Number>(), value[1].as<Number>()};
      if (std::isfinite(static_cast<double>(numbers.first)) && std::isfinite(static_cast<double>(numbers.second)))
        return numbers;
    }
  } catch (const YAML::Exception&) {  // as below
  }
  place.fail(fmt::format("must be a list of two numbers, {}", names));
}

/// Reads LOW and HIGH, LOW first.
template <typename Number>
std::pair<Number, Number> range(const Place& place, const YAML::Node& value, Number min) {
  const auto [low, high] = two_numbers<Number>(place, value, "[LOW, HIGH]");
  if (low > high) place.fail(fmt::format("LOW is {}, but must be at most HIGH, {}; swap them", low, high));
  if (low < min) place.fail(fmt::format("LOW is {}, but must be at least {}", low, min));
  return {low, high};
}

Distribution read_distribution(const Place& place) {
  constexpr const char* kKinds = "uniform, log_uniform, normal, integer or choice";
  if (!place.node.IsMap() || place.node.size() != 1)
    place.fail(fmt::format("must be a map with one key of {}, as in {{uniform: [0.1, 0.5]}}", kKinds));
  const std::string kind = place.node.begin()->first.Scalar();
  const YAML::Node value = place.node.begin()->second;
  constexpr double kLowest = std::numeric_limits<double>::lowest();
  if (kind == "uniform") {
    const auto [low, high] = range(place, value, kLowest);
    return Uniform{low, high};
  }
  if (kind == "log_uniform") {
    const auto [low, high] = range(place, value, std::numeric_limits<double>::min());
    return LogUniform{low, high};
  }
  if (kind == "normal") {
    const auto [mean, deviation] = two_numbers<double>(place, value, "[MEAN, DEVIATION]");
    if (deviation < 0) place.fail(fmt::format("DEVIATION is {}, but must be at least 0", deviation));
    return Normal{mean, deviation};
  }
  if (kind == "integer") {
    const auto [low, high] = range<std::int64_t>(place, value, -(std::int64_t{1} << 53));
    if (high - low >= std::int64_t{1} << 53) place.fail("the range must be smaller than 2^53");
    return WholeNumber{low, high};
  }
  if (kind == "choice") {
    if (!value.IsSequence() || value.size() == 0) place.fail("must be a list of at least one value");
    Choice choice;
    for (const YAML::Node& each : value) {
      YAML::Emitter text;
      text << YAML::Flow << each;
      choice.values.emplace_back(text.c_str());
    }
    return choice;
  }
  place.fail(fmt::format("unknown distribution '{}'; use {}", kind, kKinds));
}

}  // namespace

std::string draw(const Distribution& distribution, std::uint64_t seed, std::uint32_t sequence, std::uint16_t option) {
  const AddressedRandom random(seed, Purpose::dataset_choice, option);
  const double u = random.uniforms(sequence)[0];
  const auto whole = [u](std::int64_t values) { return static_cast<std::int64_t>(u * static_cast<double>(values)); };
  struct Draw {
    const AddressedRandom& random;
    std::uint32_t sequence;
    double u;
    const decltype(whole)& pick;
    std::string operator()(const Uniform& d) const { return fmt::format("{}", d.low + u * (d.high - d.low)); }
    std::string operator()(const LogUniform& d) const {
      return fmt::format("{}", std::clamp(d.low * std::pow(d.high / d.low, u), d.low, d.high));
    }
    std::string operator()(const Normal& d) const {
      return fmt::format("{}", d.mean + d.deviation * random.normals(sequence)[0]);
    }
    std::string operator()(const WholeNumber& d) const { return std::to_string(d.low + pick(d.high - d.low + 1)); }
    std::string operator()(const Choice& d) const {
      return d.values[static_cast<std::size_t>(pick(static_cast<std::int64_t>(d.values.size())))];
    }
  };
  return std::visit(Draw{random, sequence, u, whole}, distribution);
}

ScenarioTemplate read_template(const std::string& text, const std::string& name) {
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw UserError(fmt::format("{}:{}: {}", name, error.mark.line + 1, error.msg));
  }
  if (!root.IsMap()) throw UserError(name + ": must be a scenario, which is a map of keys and values");
  ScenarioTemplate result;
  const YAML::Node random = std::as_const(root)[kKey];
  if (random.IsDefined()) {
    if (!random.IsMap()) throw UserError(fmt::format("{}: {}: must be a map of keys to distributions", name, kKey));
    for (const auto& entry : random) {
      const std::string key = entry.first.Scalar();
      result.options.push_back({key, read_distribution({name, key, entry.second})});
    }
    root.remove(kKey);
  }
  YAML::Emitter out;
  out << root;
  result.yaml = out.c_str();
  return result;
}

}  // namespace esim::inline dataset
