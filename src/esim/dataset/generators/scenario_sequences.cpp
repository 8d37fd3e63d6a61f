#include "esim/dataset/generators/scenario_sequences.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <utility>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/core/random.h"
#include "esim/dataset/collector.h"
#include "esim/scenario/read.h"
#include "esim/truth/optical_flow.h"

namespace esim::inline dataset {
namespace {

constexpr const char* kSetterOfDrawn = "randomise: ";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw UserError(file.string() + ": cannot be read; must be a scenario file, or affine");
  std::ostringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

/// The extreme values of a distribution, which may be outside an option's range.
std::vector<std::string> extremes(const Distribution& distribution) {
  struct Extremes {
    std::vector<std::string> operator()(const Uniform& d) const {
      return {fmt::to_string(d.low), fmt::to_string(d.high)};
    }
    std::vector<std::string> operator()(const LogUniform& d) const {
      return {fmt::to_string(d.low), fmt::to_string(d.high)};
    }
    std::vector<std::string> operator()(const Normal& d) const { return {fmt::to_string(d.mean)}; }
    std::vector<std::string> operator()(const WholeNumber& d) const {
      return {std::to_string(d.low), std::to_string(d.high)};
    }
    std::vector<std::string> operator()(const Choice& d) const { return d.values; }
  };
  return std::visit(Extremes{}, distribution);
}

}  // namespace

ScenarioSequences::ScenarioSequences(const std::filesystem::path& file, std::vector<std::string> overrides,
                                     std::uint64_t seed, bool optical_flow, std::uint32_t sensors)
    : file_(file),
      template_(read_template(text_of(file), file.string())),
      overrides_(std::move(overrides)),
      seed_(seed),
      optical_flow_(optical_flow),
      wanted_sensors_(sensors),
      magnitudes_(sintel_magnitudes()) {
  const auto read = [&](std::vector<std::string> set, const char* setter) {
    return read_scenario(
        {.yaml = template_.yaml, .file = file_, .has_lines = false, .overrides = std::move(set), .setter = setter});
  };
  const Scenario scenario = read(overrides_, kSetter);
  for (const RandomOption& option : template_.options) {
    for (const std::string& value : extremes(option.distribution)) read({option.key + "=" + value}, kSetterOfDrawn);
  }
  if (scenario.cameras.size() != 1) {
    throw UserError(fmt::format("{}: has {} cameras, but must have one; remove the others", file_.string(),
                                scenario.cameras.size()));
  }
  const Scenario begun = scenario_of(drawn(0));
  const std::span<const SensorOptions> first = begun.cameras[0].sensors();
  sensors_ = static_cast<std::uint32_t>(first.size());
  if (first.empty())
    throw UserError(fmt::format("{}: its camera has no event sensor; remove events: false", file_.string()));
  if (std::ranges::any_of(first, &SensorOptions::labels))
    throw UserError(
        fmt::format("{}: event_camera.labels: data sets have no labels of events; remove it", file_.string()));
}

std::string ScenarioSequences::options() const {
  nlohmann::ordered_json drawn_from = nlohmann::ordered_json::object();
  for (const RandomOption& option : template_.options) {
    drawn_from[option.key] = {{"kind", option.distribution.index()}, {"values", extremes(option.distribution)}};
    if (const auto* const normal = std::get_if<Normal>(&option.distribution))
      drawn_from[option.key]["deviation"] = normal->deviation;
  }
  nlohmann::ordered_json options{{"kind", "scenario"},      {"scenario", template_.yaml},
                                 {"randomise", drawn_from}, {"set", overrides_},
                                 {"seed", seed_},           {"optical_flow", optical_flow_}};
  if (wanted_sensors_ > 1) options["sensors"] = wanted_sensors_;
  return options.dump();
}

/// Several sensors draw their options themselves, with seeds of their own.
bool ScenarioSequences::is_drawn_by_sensors(const RandomOption& option) const {
  return wanted_sensors_ > 1 && option.key.starts_with("event_camera.");
}

std::vector<std::string> ScenarioSequences::drawn(std::uint32_t rendering) const {
  std::vector<std::string> set;
  const auto words = AddressedRandom(seed_, Purpose::dataset_sensor).bits(rendering);
  set.push_back(fmt::format("seed={}", (std::uint64_t{words[0]} << 31) | words[1]));
  for (std::size_t i = 0; i < template_.options.size(); ++i) {
    const RandomOption& option = template_.options[i];
    if (is_drawn_by_sensors(option)) continue;
    set.push_back(option.key + "=" + draw(option.distribution, seed_, rendering, static_cast<std::uint16_t>(i)));
  }
  return set;
}

Scenario ScenarioSequences::scenario_of(const std::vector<std::string>& drawn) const {
  std::vector<std::string> set = drawn;
  for (const RandomOption& option : template_.options) {
    if (is_drawn_by_sensors(option)) set.push_back(option.key + "=" + option.yaml);
  }
  if (wanted_sensors_ > 1) set.push_back(fmt::format("event_camera.count={}", wanted_sensors_));
  set.insert(set.end(), overrides_.begin(), overrides_.end());
  return read_scenario({.yaml = template_.yaml,
                        .file = file_,
                        .has_lines = false,
                        .overrides = std::move(set),
                        .setter = kSetterOfDrawn});
}

std::vector<Sequence> ScenarioSequences::make_all(std::uint32_t rendering) const {
  const std::vector<std::string> set = drawn(rendering);
  nlohmann::ordered_json info = nlohmann::ordered_json::object();
  for (const std::string& text : set) info[text.substr(0, text.find('='))] = text.substr(text.find('=') + 1);
  Scenario scenario = scenario_of(set);
  if (scenario.cameras[0].sensors().size() != sensors_) {
    throw UserError(
        fmt::format("{}: the number of event sensors must be the same in all sequences, but is {} and {}; "
                    "do not randomise it",
                    file_.string(), sensors_, scenario.cameras[0].sensors().size()));
  }

  // Only the events and the ground truth at the two instants are needed.
  scenario.truth = TruthOptions{};
  scenario.truth.rate_hz = 0;
  scenario.imu.reset();
  for (CameraOptions& camera : scenario.cameras) camera.frame_camera.reset();
  const auto ignore = [](const std::string&) {};
  World world = build_world(scenario, 1, {ignore, ignore});

  std::vector<Sequence> sequences(sensors_);
  Collector collector(sequences);
  simulate(world, collector, [](const Progress&) { return true; });

  const TimeNs start = world.info.start, end = world.info.end;
  Renderer& renderer = *world.cameras[0].renderer;
  Sample sample;
  OpticalFlowFromDepth field(world.info.cameras[0].model, world.deforming, *world.workers);
  const RenderRequest first = view(world, 0, start), last = view(world, 0, end);
  Sequence truth;
  renderer.render(first, sample);
  truth.first = sample.irradiance;
  truth.depth = sample.depth;
  const bool has_optical_flow = optical_flow_ && !renderer.traits().on_sensor;
  if (has_optical_flow) field.advance(first, sample);
  renderer.render(last, sample);
  truth.last = sample.irradiance;
  truth.motion_field = {sample.motion_x, sample.motion_y};
  truth.motion_field_t = end - start;
  if (has_optical_flow) {
    const OpticalFlowImages* const optical_flow = field.advance(last, sample);
    truth.optical_flow = {optical_flow->x, optical_flow->y};
  }
  info["motion_field_t"] = truth.motion_field_t;
  for (std::uint32_t k = 0; k < sensors_; ++k) {
    Sequence sequence = truth;
    sequence.index = rendering * sensors_ + k;
    sequence.width = sequences[k].width, sequence.height = sequences[k].height;
    sequence.span = sequences[k].span;
    sequence.events = std::move(sequences[k].events);
    nlohmann::ordered_json own = info;
    const SensorOptions& sensor = scenario.cameras[0].sensors()[k];
    if (!sensor.name.empty()) own["sensor"] = sensor.name;
    for (const SensorOptions::Varied& option : sensor.varied) own["event_camera." + option.key] = option.value;
    sequence.info = own.dump();
    sequences[k] = std::move(sequence);
  }
  return sequences;
}

}  // namespace esim::inline dataset
