#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

namespace esim::inline event_camera {

/// Time constants of a pixel's circuit before its comparators (docs/methods/circuit.md).
struct CircuitPoles {
  double t1_unit_ns = 0;        ///< of the photodiode, Q / I, at the photocurrent of L = 0
  double t2_ns = 0;             ///< of the source follower
  double high_pass_per_ns = 0;  ///< k3, angular cut-off frequency of the high-pass; 0: without one
};

/// The part of the brightness signal that follows light, after an instant. Light is L = ln(E + dark), natural
/// logarithm.
///
/// Photodiode (large signal): Q dy/dt = I - exp(y), or (1 + lag)' = lambda (1 + lag) - lag I / Q with
/// 1 + lag = exp(L - y) and lambda = dL/dt. In steady light, lag = 0 and y = L.
/// Source follower: t2 dv/dt = y - v. High-pass, if there is one: its output is v - w with dw/dt = k3 (v - w).
struct CircuitState {
  double lag = 0;  ///< exp(L - y) - 1
  double v = 0;
  double w = 0;  ///< only with a high-pass
};

/// What the comparators see, without leak and noise, on a stretch of time in which the photodiode's response is an
/// exponential plus a line: level + rate s + fast exp(-k1 s) + slow exp(-k2 s) + passed exp(-k3 s), s in ns after its
/// start, k2 = 1 / t2. Without a high-pass, passed is 0.
struct CircuitPiece {
  double level = 0, rate = 0, fast = 0, slow = 0, k1 = 0, k2 = 0;
  double length = 0;  ///< ns
  double passed = 0, k3 = 0;

  double value(double s) const {
    const double v = level + rate * s + fast * std::exp(-k1 * s) + slow * std::exp(-k2 * s);
    return k3 == 0 ? v : v + passed * std::exp(-k3 * s);
  }
  double slope(double s) const {
    const double v = rate - fast * k1 * std::exp(-k1 * s) - slow * k2 * std::exp(-k2 * s);
    return k3 == 0 ? v : v - passed * k3 * std::exp(-k3 * s);
  }

  /// How far the values leave the chord between those at a and b, at most.
  double beyond_chord(double a, double b) const {
    const double e1 = std::abs(fast) * std::exp(-k1 * a), e2 = std::abs(slow) * std::exp(-k2 * a);
    const double e3 = k3 == 0 ? 0.0 : std::abs(passed) * std::exp(-k3 * a);
    const double curvature = e1 * k1 * k1 + e2 * k2 * k2 + e3 * k3 * k3;
    // Either the curvature limits it, or that each exponential is monotone.
    return std::min(0.125 * (b - a) * (b - a) * curvature, e1 + e2 + e3);
  }

  /// Bounds of the values on [a, b].
  std::pair<double, double> range(double a, double b) const {
    const double va = value(a), vb = value(b), beyond = beyond_chord(a, b);
    return {std::min(va, vb) - beyond, std::max(va, vb) + beyond};
  }
};

/// The light of a pixel on a stretch: L(s) = light + rate s.
struct LightRamp {
  double light = 0, rate = 0;  ///< rate in 1/ns
};

/// The moments psi_k(a) = integral over x from 0 to 1 of x^k exp(-a (1 - x)), k = 0 to 3, for a >= 0.
std::array<double, 4> exponential_moments(double a);

/// Longest stretch that advance() takes in one step: the light may change by at most this.
inline constexpr double kMaxLightStep = 0.1;

/// If the lag is farther than kMaxTransient from that of a steady ramp, by T, steps must be shorter than kMaxDecay Q /
/// I, or, for T below 1, T^(-1/4) times as long: the response differs from an exponential by T^2 times the cube of the
/// step.
inline constexpr double kMaxTransient = 0.03;
inline constexpr double kMaxDecay = 0.25;

/// Length of the next step of advance() on a ramp that goes on for `length` ns. Far from equilibrium, steps are short
/// compared with Q / I.
double step_length(const CircuitPoles& poles, const CircuitState& state, const LightRamp& ramp, double length);

/// Advances the state by `length` ns, and returns the signal on the way.
CircuitPiece advance(const CircuitPoles& poles, CircuitState& state, const LightRamp& ramp, double length);

}  // namespace esim::inline event_camera
