// Known circuits under lamps and in constant light, simulated and fitted.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "esim/event_camera/noise_rate.h"
#include "esim/fit/circuit/circuit_fit.h"
#include "esim/fit/circuit/circuit_simulation.h"
#include "fit/known_sensors.h"

namespace esim::test {

inline constexpr int kCircuitSide = 32;  // px

/// A circuit with random thresholds and time constants. `noise`: the range of its thresholds in standard deviations of
/// the noise in the dark.
inline EventCameraOptions random_circuit(std::uint32_t number, std::array<double, 2> noise) {
  const auto between = random_parameters(11, number);
  EventCameraOptions o;
  o.contrast_threshold_on = between(0, 0.12, 0.3);
  o.contrast_threshold_off = *o.contrast_threshold_on * between(1, 0.8, 1.25);
  o.refractory_period_us = between(2, 20, 300);
  o.leak_rate_hz = between(3, 0.05, 0.3);
  o.leak_mismatch_decades = 0.2;
  CircuitOptions& c = o.circuit.emplace();
  c.threshold_mismatch_common = between(4, 0.03, 0.08);
  c.photocurrent_fa_per_lux = between(5, 5, 40);
  c.source_follower_hz = between(6, 150, 2000);
  c.photodiode_charge_e = std::pow(2 * between(7, noise[0], noise[1]) / (o.threshold_on() + o.threshold_off()), 2);
  c.dark_current_fa = between(8, 0.5, 5);
  return on_bench(o);
}

/// A lamp at little light for the photodiode's pole, and at much light for that of the source follower.
inline std::vector<PixelCounts> record_lamps(const EventCameraOptions& sensor, std::uint64_t seed,
                                             int side = kCircuitSide) {
  constexpr double kSettlingPeriods = 20, kSettling_s = 0.05, kPeriods = 16;
  std::vector<PixelCounts> all;
  const auto record = [&](double lux, double hz) {
    all.push_back(
        simulate_counts(sensor, {lux, hz, 0.6}, std::max(kSettlingPeriods, kSettling_s * hz), kPeriods, side, seed));
  };
  for (const double hz : {25.0, 100.0, 400.0}) record(10, hz);
  for (const double hz : {50.0, 200.0, 800.0}) record(300, hz);
  return all;
}

/// Constant light. About `off_events` are expected, but at most 20 s.
inline std::vector<PixelCounts> record_noise(const EventCameraOptions& sensor, std::uint64_t seed,
                                             int side = kCircuitSide, double off_events = 4000) {
  std::vector<PixelCounts> all;
  for (const double lux : {0.0, 0.2, 5.0}) {
    const double off_hz = 0.5 * noise_rate_hz(sensor, lux);
    all.push_back(simulate_counts(sensor, {lux, 0, 0}, std::min(20.0, 6 / off_hz),
                                  std::min(20.0, off_events / (off_hz * side * side)), side, seed));
  }
  return all;
}

inline constexpr std::array kLampNoise{3.0, 5.0}, kMuchNoise{2.0, 2.8};

/// What is known before the fit to lamps: neither thresholds nor time constants.
inline CircuitFit fit_lamps(const EventCameraOptions& truth, std::vector<PixelCounts> recordings) {
  CircuitInput input{truth, std::move(recordings)};
  input.base.contrast_threshold_on = input.base.contrast_threshold_off = 0.25;
  input.base.circuit->photocurrent_fa_per_lux = 14, input.base.circuit->source_follower_hz = 550;
  return fit_circuit(input);
}

/// What is known before the fit to constant light: thresholds and photocurrent.
inline CircuitFit fit_noise(const EventCameraOptions& truth, std::vector<PixelCounts> recordings) {
  CircuitInput input{truth, std::move(recordings)};
  CircuitOptions& c = *input.base.circuit;
  c.source_follower_hz = 550, c.photodiode_charge_e = 1.5 * c.photodiode_charge_e, c.dark_current_fa = 1.6;
  return fit_circuit(input);
}

/// The true value of a parameter that is fitted.
inline double true_value(const EventCameraOptions& truth, const std::string& name) {
  if (name == "contrast_threshold_on") return truth.threshold_on();
  if (name == "contrast_threshold_off") return truth.threshold_off();
  if (name == "circuit.photocurrent_fa_per_lux") return truth.circuit->photocurrent_fa_per_lux;
  if (name == "circuit.source_follower_hz") return truth.circuit->source_follower_hz;
  return name == "circuit.photodiode_charge_e" ? truth.circuit->photodiode_charge_e : truth.circuit->dark_current_fa;
}

}  // namespace esim::test
