#include <fmt/format.h>

#include "esim/core/error.h"
#include "esim/event_camera/options.h"

namespace esim::inline event_camera {
namespace {

/// The parameters by which sensors differ; docs/methods/pixel.md has their sources.
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

/// Fitted to recordings (docs/methods/circuit.md), except for what a comment says.
EventCameraOptions davis240c_by_circuit() {
  EventCameraOptions o;
  o.contrast_threshold = 0.55;
  o.threshold_ratio = 0.87;
  o.threshold_mismatch = 0.02;
  o.refractory_period_us = 1450;
  o.leak_rate_hz = 0.04;
  o.leak_mismatch_decades = 0.7;
  o.hot_pixels = 0.02;
  o.hot_pixel_rate_hz = 2;
  o.readout.rate_mev_per_s = 4;
  o.readout.row_time_us = 0.3;
  o.readout.row_scan_us = 0.01;
  o.readout.row_rest_us = 5.5;
  CircuitOptions circuit;
  circuit.photocurrent_fa_per_lux = 30;  // 18.5 um pixels, fill factor 0.22, 0.3 A/W
  circuit.dark_current_fa = 1;           // chosen
  circuit.photodiode_charge_e = 600;     // Graca and Delbruck's circuit
  circuit.source_follower_hz = 3000;
  circuit.threshold_mismatch_common = 0.07;
  circuit.refractory_mismatch_decades = 0.04;
  o.circuit = circuit;
  return o;
}

EventCameraOptions values_of(SensorPreset preset) {
  switch (preset) {
    case SensorPreset::ideal:
      return {};
    case SensorPreset::dvs128:
      return options_of({0.20, 0.021, 0.1, 5, 3000, 500, 15, 2, 1, 0});
    case SensorPreset::davis240c:
      return options_of({0.20, 0.034, 0.1, 10, 300, 500, 3, 2, 10, 0.1});
    case SensorPreset::davis346:
      return options_of({0.20, 0.034, 0.2, 10, 300, 500, 20, 2, 12, 0.08});
    case SensorPreset::dvxplorer:
      return options_of({0.243, 0.040, 0.03, 5, 300, 200, 150, 58, 165, 0.31});
    case SensorPreset::gen31_vga:
      return options_of({0.182, 0.03, 0.07, 5, 800, 100, 40, 20, 50, 0});
    case SensorPreset::imx636:
      return options_of({0.223, 0.03, 0.1, 5, 1600, 100, 20, 10, 1066, 0.1});
    case SensorPreset::v2e_clean:
      return v2e_options({0.2, 0.02, 0, 0, 0, 0, 0, 0, 0, 0});
    case SensorPreset::davis240c_2:
      return davis240c_by_circuit();
    case SensorPreset::v2e_noisy:
      return v2e_options({0.2, 0.05, 0.1, 5, 30, 0, 0, 0, 0, 0});
  }
  return {};
}

}  // namespace

void check(const EventCameraOptions& o) {
  if (!o.circuit) return;
  const auto refuse = [](const char* name, double value) {
    if (value == 0) return;
    throw UserError(fmt::format("event camera: {} = {:.6g}, but with circuit this follows from the circuit; remove it",
                                name, value));
  };
  refuse("threshold_noise", o.threshold_noise);
  refuse("low_pass_hz", o.low_pass_hz);
  refuse("surround_px", o.surround_px);
  refuse("shot_noise_hz", o.shot_noise_hz);
  refuse("latency_us", o.latency_us);
  refuse("latency_jitter_us", o.latency_jitter_us);
  if (o.response != PixelResponse::log) throw UserError("event camera: response: circuit needs log");
  if (o.refractory_mode != RefractoryMode::hold) throw UserError("event camera: refractory_mode: circuit needs hold");
}

EventCameraOptions preset_options(SensorPreset preset) {
  EventCameraOptions options = values_of(preset);
  options.preset = preset;
  return options;
}

}  // namespace esim::inline event_camera
