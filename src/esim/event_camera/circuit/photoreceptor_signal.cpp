#include "esim/event_camera/circuit/photoreceptor_signal.h"

namespace esim::inline event_camera {

std::array<double, 4> exponential_moments(double a) {
  // psi_0 = (1 - exp(-a)) / a and a psi_k = 1 - k psi_{k-1}: stable upwards for large a, downwards for small a.
  if (a >= 2) {
    const double p0 = -std::expm1(-a) / a, p1 = (1 - p0) / a, p2 = (1 - 2 * p1) / a;
    return {p0, p1, p2, (1 - 3 * p2) / a};
  }
  double term = 0.25, p3 = 0.25;  // sum over j of (-a)^j 3! / (4 + j)!
  for (int j = 1; j < 20; ++j) term *= -a / (4 + j), p3 += term;
  const double p2 = (1 - a * p3) / 3, p1 = (1 - a * p2) / 2;
  return {1 - a * p1, p1, p2, p3};
}

double step_length(const CircuitPoles& poles, const CircuitState& state, const LightRamp& ramp, double length) {
  const double change = std::abs(ramp.rate) * length;
  const double step = length / std::max(1.0, std::ceil(change / kMaxLightStep - 1e-9));
  // Far from the lag that the ramp keeps up, the response is not an exponential.
  const double rate = std::exp(ramp.light) / poles.t1_unit_ns;
  const double transient = std::abs(state.lag - ramp.rate / rate);
  if (transient <= kMaxTransient) return step;
  const double decay = kMaxDecay / std::sqrt(std::sqrt(std::min(1.0, transient)));
  return std::min(step, decay / (rate * std::exp(std::max(0.0, ramp.rate * step))));
}

namespace {

/// The output of the high-pass, of the source follower's `v`. Advances the state.
CircuitPiece high_passed(const CircuitPiece& v, double k3, CircuitState& state) {
  CircuitPiece passed = v;
  passed.k3 = k3;
  passed.level = v.rate / k3, passed.rate = 0;
  passed.fast = v.fast * v.k1 / (v.k1 - k3), passed.slow = v.slow * v.k2 / (v.k2 - k3);
  passed.passed = (state.v - state.w) - passed.level - passed.fast - passed.slow;
  state.v = v.value(v.length);
  state.w = state.v - passed.value(v.length);
  return passed;
}

}  // namespace

CircuitPiece advance(const CircuitPoles& poles, CircuitState& state, const LightRamp& ramp, double length) {
  // With a = integral of I / Q, in which I is linear: lag1 = (1 + rho) [lag0 exp(-A) + rho integral of
  // exp(-A (1 - x)) / (1 + rho x)^2 over x], 1 + rho = I1 / I0. The quotient is replaced by a cubic through
  // x = 0, 1/3, 2/3 and 1.
  const double rate0 = std::exp(ramp.light) / poles.t1_unit_ns;  // I / Q
  const double growth = ramp.rate * length, rho = std::expm1(growth);
  const double area = rate0 * length * (growth != 0 ? rho / growth : 1.0);
  const auto psi = exponential_moments(area);
  const double decay = 1 - area * psi[0];
  const auto quotient = [rho](double x) { return 1 / ((1 + rho * x) * (1 + rho * x)); };
  const double f0 = 1, f1 = quotient(1.0 / 3), f2 = quotient(2.0 / 3), f3 = quotient(1.0);
  const double c1 = (-11 * f0 + 18 * f1 - 9 * f2 + 2 * f3) / 2, c2 = (18 * f0 - 45 * f1 + 36 * f2 - 9 * f3) / 2,
               c3 = 9 * (-f0 + 3 * f1 - 3 * f2 + f3) / 2;
  const double integral = f0 * psi[0] + c1 * psi[1] + c2 * psi[2] + c3 * psi[3];
  const double lag1 = (1 + rho) * (state.lag * decay + rho * integral);

  // y = start + slope s + gap (exp(-k s) - 1), through y and its slope at the start and y at the end.
  const double y0 = ramp.light - std::log1p(state.lag), rise = growth - std::log1p(lag1) + std::log1p(state.lag);
  const double slope0 = rate0 * state.lag / (1 + state.lag);
  double a = std::max(area, 1e-3), k = a / length;
  for (const double other :
       {1 / poles.t2_ns, poles.high_pass_per_ns}) {  // at resonance, the quotients below would fail
    if (std::abs(k - other) < 0.005 * other) k = 1.005 * other, a = k * length;
  }
  const double mean_decay = a == area ? psi[0] : -std::expm1(-a) / a;
  const double slope = (rise / length - slope0 * mean_decay) / (1 - mean_decay), gap = (slope - slope0) / k;

  CircuitPiece piece;
  piece.length = length;
  piece.k1 = k;
  piece.k2 = 1 / poles.t2_ns;
  piece.rate = slope;
  piece.level = y0 - gap - slope * poles.t2_ns;
  piece.fast = gap / (1 - k * poles.t2_ns);
  piece.slow = state.v - piece.level - piece.fast;
  state.lag = lag1;
  if (poles.high_pass_per_ns > 0) return high_passed(piece, poles.high_pass_per_ns, state);
  state.v = piece.value(length);
  return piece;
}

}  // namespace esim::inline event_camera
