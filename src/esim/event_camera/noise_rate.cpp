#include "esim/event_camera/noise_rate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace esim::inline event_camera {
namespace {

constexpr double kExcessive = 2;  // thresholds in standard deviations
constexpr double kUsualMaxRate_hz = 1e4;

/// Time constants of the two poles, s.
struct Poles {
  double t1, t2;
};

Poles poles_at(const CircuitOptions& circuit, double irradiance) {
  const double current_fa = circuit.white_photocurrent_fa() * irradiance + circuit.dark_current_fa;
  return {circuit.photodiode_s(current_fa), circuit.source_follower_s()};
}

}  // namespace

double noise_deviation(const CircuitOptions& circuit, double irradiance) {
  const auto [t1, t2] = poles_at(circuit, irradiance);
  return circuit.noise * std::sqrt(t1 / (t1 + t2) / circuit.photodiode_charge_e);
}

double noise_rate_hz(const EventCameraOptions& options, double irradiance) {
  const CircuitOptions& circuit = *options.circuit;
  const double deviation = noise_deviation(circuit, irradiance);
  if (deviation == 0) return 0;
  const auto [t1, t2] = poles_at(circuit, irradiance);
  const double zero_crossings_hz = 1 / (2 * std::numbers::pi * std::sqrt(t1 * t2));  // upwards
  // Events of both polarities alternate, so that the mean of the thresholds counts.
  const double z = 0.5 * (options.threshold_on() + options.threshold_off()) / deviation;
  // Rice's rate of crossings of levels that are a threshold apart, and a diffusion to the next level.
  const double crossing_s = z / (2 * std::sqrt(2 * std::numbers::pi) * zero_crossings_hz);
  const double diffusion_s = 0.5 * z * z * (t1 + t2);
  const double rate = std::exp(-0.1 * z * z) / (crossing_s + diffusion_s);
  const double dead_s = std::max(1e-6 * options.refractory_period_us, 1 / max_rate_hz(options));
  return rate / (1 + rate * dead_s);
}

std::optional<NoiseEstimate> excessive_noise(const EventCameraOptions& options) {
  if (!options.circuit) return std::nullopt;
  NoiseEstimate estimate{options.min_threshold(), noise_deviation(*options.circuit, 0), 0, 0};
  if (estimate.threshold >= kExcessive * estimate.deviation) return std::nullopt;
  constexpr int kSteps = 60;
  for (int i = -1; i <= kSteps; ++i) {
    const double irradiance = i < 0 ? 0.0 : std::pow(10.0, -6.0 + 6.0 * i / kSteps);
    const double rate = noise_rate_hz(options, irradiance);
    if (rate > estimate.rate_hz) estimate.rate_hz = rate, estimate.irradiance = irradiance;
  }
  return estimate;
}

double max_rate_hz(const EventCameraOptions& options) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (!options.circuit) return kNone;
  if (options.circuit->max_rate_hz > 0) return options.circuit->max_rate_hz;
  if (options.refractory_period_us > 0 || options.readout.acknowledges()) return kNone;
  const bool excessive = options.min_threshold() < kExcessive * noise_deviation(*options.circuit, 0);
  return excessive ? kUsualMaxRate_hz : kNone;
}

}  // namespace esim::inline event_camera
