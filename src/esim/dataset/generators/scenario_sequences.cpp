#include "esim/dataset/generators/scenario_sequences.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
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
                                     std::uint64_t seed, bool optical_flow)
    : file_(file),
      template_(read_template(text_of(file), file.string())),
      overrides_(std::move(overrides)),
      seed_(seed),
      optical_flow_(optical_flow),
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
  if (scenario.cameras[0].event_camera.labels)
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
  return nlohmann::ordered_json{{"kind", "scenario"},      {"scenario", template_.yaml},
                                {"randomise", drawn_from}, {"set", overrides_},
                                {"seed", seed_},           {"optical_flow", optical_flow_}}
      .dump();
}

std::vector<std::string> ScenarioSequences::drawn(std::uint32_t index) const {
  std::vector<std::string> set;
  const auto words = AddressedRandom(seed_, Purpose::dataset_sensor).bits(index);
  set.push_back(fmt::format("seed={}", (std::uint64_t{words[0]} << 31) | words[1]));
  for (std::size_t i = 0; i < template_.options.size(); ++i) {
    const RandomOption& option = template_.options[i];
    set.push_back(option.key + "=" + draw(option.distribution, seed_, index, static_cast<std::uint16_t>(i)));
  }
  return set;
}

Sequence ScenarioSequences::make(std::uint32_t index) const {
  std::vector<std::string> set = drawn(index);
  nlohmann::ordered_json info = nlohmann::ordered_json::object();
  for (const std::string& text : set) info[text.substr(0, text.find('='))] = text.substr(text.find('=') + 1);
  set.insert(set.end(), overrides_.begin(), overrides_.end());
  Scenario scenario = read_scenario({.yaml = template_.yaml,
                                     .file = file_,
                                     .has_lines = false,
                                     .overrides = std::move(set),
                                     .setter = kSetterOfDrawn});

  // Only the events and the ground truth at the two instants are needed.
  scenario.truth = TruthOptions{};
  scenario.truth.rate_hz = 0;
  scenario.imu.reset();
  for (CameraOptions& camera : scenario.cameras) camera.frame_camera.reset();
  const auto ignore = [](const std::string&) {};
  World world = build_world(scenario, 1, {ignore, ignore});

  Sequence sequence;
  sequence.index = index;
  Collector collector(sequence);
  simulate(world, collector, [](const Progress&) { return true; });

  const TimeNs start = world.info.start, end = world.info.end;
  Renderer& renderer = *world.cameras[0].renderer;
  Sample sample;
  OpticalFlowFromDepth field(world.info.cameras[0].model, *world.workers);
  const RenderRequest first = view(world, 0, start), last = view(world, 0, end);
  renderer.render(first, sample);
  sequence.first = sample.irradiance;
  sequence.depth = sample.depth;
  const bool has_optical_flow = optical_flow_ && !renderer.traits().on_sensor;
  if (has_optical_flow) field.advance(first, sample);
  renderer.render(last, sample);
  sequence.last = sample.irradiance;
  sequence.motion_field = {sample.motion_x, sample.motion_y};
  sequence.motion_field_t = end - start;
  if (has_optical_flow) {
    const OpticalFlowImages* const optical_flow = field.advance(last, sample);
    sequence.optical_flow = {optical_flow->x, optical_flow->y};
  }
  info["motion_field_t"] = sequence.motion_field_t;
  sequence.info = info.dump();
  return sequence;
}

}  // namespace esim::inline dataset
