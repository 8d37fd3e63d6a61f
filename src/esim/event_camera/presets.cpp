#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "esim/core/error.h"
#include "esim/event_camera/options.h"

namespace esim::inline event_camera {
namespace {

/// The parameters by which sensors differ; docs/methods/presets.md has their sources.
struct SensorFigures {
  double threshold, mismatch;  // ln
  double leak_hz, shot_hz;     // per pixel; shot noise in the dark
  double low_pass_hz, refractory_us;
  double latency_us, jitter_us;
  double readout_mev_per_s, row_us;
};

EventCameraOptions options_of(const SensorFigures& figures) {
  EventCameraOptions o;
  o.contrast_threshold = figures.threshold;
  o.threshold_mismatch = figures.mismatch;
  o.leak_rate_hz = figures.leak_hz;
  o.leak_mismatch_decades = 0.1;
  o.leak_jitter = 0.1;
  o.shot_noise_hz = figures.shot_hz;
  o.low_pass_hz = figures.low_pass_hz;
  o.refractory_period_us = figures.refractory_us;
  o.latency_us = figures.latency_us;
  o.latency_jitter_us = figures.jitter_us;
  o.readout.rate_mev_per_s = figures.readout_mev_per_s;
  o.readout.row_time_us = figures.row_us;
  return o;
}

/// The models of v2e, without its time slots; its brightness is linear near zero.
EventCameraOptions v2e_options(const SensorFigures& figures) {
  EventCameraOptions o = options_of(figures);
  o.response = PixelResponse::lin_log;
  return o;
}

/// What the sensors by their circuit have in common. docs/methods/presets.md has the sources of all values.
EventCameraOptions by_circuit(double fa_per_lux, double dark_fa, double source_follower_hz) {
  EventCameraOptions o;
  o.leak_mismatch_decades = 0.3;
  o.hot_pixels = 0.0012;
  o.hot_pixel_rate_hz = 2;
  CircuitOptions& circuit = o.circuit.emplace();
  circuit.photocurrent_fa_per_lux = fa_per_lux;
  circuit.dark_current_fa = dark_fa;
  circuit.source_follower_hz = source_follower_hz;
  circuit.refractory_mismatch_decades = 0.04;
  return o;
}

EventCameraOptions dvs128_by_circuit() {
  EventCameraOptions o = by_circuit(57, 4, 3000);
  o.contrast_threshold = 0.20;
  o.threshold_mismatch = 0.021;
  o.refractory_period_us = 500;
  o.leak_rate_hz = 0.1;
  o.readout.rate_mev_per_s = 1;
  o.readout.time_stamp_us = 1;
  return o;
}

EventCameraOptions davis240c_by_circuit() {
  EventCameraOptions o = by_circuit(30, 1, 3000);
  o.contrast_threshold = 0.55;
  o.threshold_ratio = 0.85;
  o.threshold_mismatch = 0.02;
  o.circuit->threshold_mismatch_common = 0.07;
  o.circuit->frame_coupling = 0.03;
  o.refractory_period_us = 1300;
  o.leak_rate_hz = 0.02;
  o.readout.rate_mev_per_s = 10;
  o.readout.row_time_us = 0.2;
  o.readout.row_wait_us = 6;
  o.readout.column_coupling = 1;
  o.readout.time_stamp_us = 1;
  return o;
}

EventCameraOptions davis346_by_circuit() {
  EventCameraOptions o = by_circuit(33, 1, 1000);
  o.contrast_threshold = 0.134;
  o.threshold_ratio = 1.51;
  o.threshold_mismatch = 0.005;
  o.circuit->threshold_mismatch_common = 0.07;
  o.refractory_period_us = 500;
  o.leak_rate_hz = 0.2;
  o.readout.rate_mev_per_s = 12;
  o.readout.row_time_us = 0.08;
  o.readout.row_wait_us = 6;
  o.readout.column_coupling = 1;
  o.readout.time_stamp_us = 1;
  return o;
}

EventCameraOptions dvxplorer_by_circuit() {
  EventCameraOptions o = by_circuit(4, 0.3, 1000);
  o.contrast_threshold = 0.243;
  o.threshold_mismatch = 0.040;
  o.leak_rate_hz = 0.03;
  o.readout.scan_period_us = 197.3;
  return o;
}

/// The sensors of Prophesee: an arbiter reads rows in the order of their requests, and stamps them in microseconds.
EventCameraOptions prophesee(EventCameraOptions o, double rate_mev_per_s, double row_time_us) {
  o.readout.rate_mev_per_s = rate_mev_per_s;
  o.readout.row_time_us = row_time_us;
  o.readout.time_stamp_us = 1;
  return o;
}

EventCameraOptions gen31_by_circuit() {
  EventCameraOptions o = prophesee(by_circuit(25, 1, 800), 150, 0.18);
  o.contrast_threshold = 0.182;
  o.threshold_mismatch = 0.03;
  o.refractory_period_us = 10;
  o.leak_rate_hz = 0.07;
  return o;
}

EventCameraOptions imx636_by_circuit() {
  EventCameraOptions o = prophesee(by_circuit(8, 0.64, 1600), 1066, 0.1);
  o.contrast_threshold = 0.223;
  o.threshold_mismatch = 0.01;
  o.refractory_period_us = 79;
  o.leak_rate_hz = 0.01;
  return o;
}

EventCameraOptions genx320_by_circuit() {
  EventCameraOptions o = prophesee(by_circuit(13, 0.64, 1600), 200, 0.1);
  o.contrast_threshold = 0.262;
  o.threshold_mismatch = 0.01;
  o.refractory_period_us = 79;
  o.leak_rate_hz = 0.01;
  return o;
}

struct Entry {
  const char* sensor;
  int version;
  EventCameraOptions (*options)();
};

/// The versions of a sensor follow each other, the newest one first.
constexpr std::array<Entry, 16> kPresets{{
    {"ideal", 0, [] { return EventCameraOptions{}; }},
    {"dvs128", 2, dvs128_by_circuit},
    {"dvs128", 1,
     [] {
       return options_of({0.20, 0.021, 0.1, 5, 3000, 500, 15, 2, 1, 0});
     }},
    {"davis240c", 2, davis240c_by_circuit},
    {"davis240c", 1,
     [] {
       return options_of({0.20, 0.034, 0.1, 10, 300, 500, 3, 2, 10, 0.1});
     }},
    {"davis346", 2, davis346_by_circuit},
    {"davis346", 1,
     [] {
       return options_of({0.20, 0.034, 0.2, 10, 300, 500, 20, 2, 12, 0.08});
     }},
    {"dvxplorer", 2, dvxplorer_by_circuit},
    {"dvxplorer", 1,
     [] {
       return options_of({0.243, 0.040, 0.03, 5, 300, 200, 150, 58, 165, 0.31});
     }},
    {"gen3.1-vga", 2, gen31_by_circuit},
    {"gen3.1-vga", 1,
     [] {
       return options_of({0.182, 0.03, 0.07, 5, 800, 100, 40, 20, 50, 0});
     }},
    {"imx636", 2, imx636_by_circuit},
    {"imx636", 1,
     [] {
       return options_of({0.223, 0.03, 0.1, 5, 1600, 100, 20, 10, 1066, 0.1});
     }},
    {"genx320", 2, genx320_by_circuit},
    {"v2e-clean", 0,
     [] {
       return v2e_options({0.2, 0.02, 0, 0, 0, 0, 0, 0, 0, 0});
     }},
    {"v2e-noisy", 0,
     [] {
       return v2e_options({0.2, 0.05, 0.1, 5, 30, 0, 0, 0, 0, 0});
     }},
}};

SensorPreset preset_of(const Entry& entry) { return {entry.sensor, entry.version}; }

}  // namespace

std::string SensorPreset::name() const { return version == 0 ? sensor : fmt::format("{}@{}", sensor, version); }

std::vector<std::string> SensorPreset::names() {
  std::vector<std::string> names;
  std::string_view before;
  for (const Entry& entry : kPresets) {
    if (entry.sensor != before) names.emplace_back(entry.sensor);
    if (entry.version != 0) names.push_back(preset_of(entry).name());
    before = entry.sensor;
  }
  return names;
}

std::optional<SensorPreset> SensorPreset::find(std::string_view name) {
  for (const Entry& entry : kPresets) {
    if (name == entry.sensor || name == preset_of(entry).name()) return preset_of(entry);
  }
  return std::nullopt;
}

std::string SensorPreset::problem(std::string_view name) {
  if (find(name)) return "";
  const std::string_view sensor = name.substr(0, name.find('@'));
  std::string versions;
  int count = 0;
  for (const Entry& entry : kPresets) {
    if (sensor != entry.sensor) continue;
    if (entry.version == 0) return fmt::format("{} has no versions", sensor);
    versions = versions.empty() ? fmt::format("{}", entry.version) : fmt::format("{} and {}", entry.version, versions);
    ++count;
  }
  if (count == 0) return "";
  return fmt::format("'{}' does not exist; {} has the version{} {}", name, sensor, count > 1 ? "s" : "", versions);
}

EventCameraOptions preset_options(const SensorPreset& preset) {
  for (const Entry& entry : kPresets) {
    if (preset != preset_of(entry)) continue;
    EventCameraOptions options = entry.options();
    options.preset = preset;
    return options;
  }
  return preset_options(preset.name());  // throws
}

EventCameraOptions preset_options(std::string_view name) {
  if (const std::optional<SensorPreset> preset = SensorPreset::find(name)) return preset_options(*preset);
  const std::string problem = SensorPreset::problem(name);
  throw UserError("event camera: preset: " + (problem.empty() ? fmt::format("there is no '{}'", name) : problem));
}

}  // namespace esim::inline event_camera
