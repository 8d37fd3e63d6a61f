#include "esim/event_camera/circuit/photoreceptor_signal.h"

#include "esim/event_camera/circuit/photoreceptor_vectors.h"

namespace esim::inline event_camera {
namespace {

using One = hn::CappedTag<double, 1>;

}  // namespace

std::array<double, 4> exponential_moments(double a) {
  const auto moments = exponential_moments(One(), hn::Set(One(), a));
  return {hn::GetLane(moments[0]), hn::GetLane(moments[1]), hn::GetLane(moments[2]), hn::GetLane(moments[3])};
}

double step_length(const CircuitPoles& poles, const CircuitState& state, const LightRamp& ramp, double length) {
  const auto set = [](double value) { return hn::Set(One(), value); };
  return hn::GetLane(ramp_of_step(One(), poles, set(ramp.light), set(state.lag), set(ramp.rate), set(length)).length);
}

CircuitPiece advance(const CircuitPoles& poles, CircuitState& state, const LightRamp& ramp, double length) {
  const One d;
  const auto set = [](double value) { return hn::Set(One(), value); };
  const double growth = ramp.rate * length, k3 = poles.high_pass_per_ns;
  CircuitRamps<One> over;
  over.light1 = set(ramp.light + growth), over.growth = set(growth), over.rho = hn::Expm1(d, set(growth));
  over.rate0 = hn::Mul(hn::Exp(d, set(ramp.light)), set(1 / poles.t1_unit_ns)), over.length = set(length);
  over.decay2 = hn::Exp(d, set(-length / poles.t2_ns)), over.decay3 = hn::Exp(d, set(-k3 * length));
  const auto y = hn::Sub(set(ramp.light), logarithm_of_one_plus(d, set(state.lag)));
  CircuitStates<One> states{set(ramp.light), set(state.lag), y, set(state.v), set(state.w)};
  const CircuitPieces<One> pieces = advance(d, poles, over, area_of(d, over), states);
  state = {hn::GetLane(states.lag), hn::GetLane(states.v), hn::GetLane(states.w)};
  CircuitPiece piece;
  piece.level = hn::GetLane(pieces.level), piece.rate = hn::GetLane(pieces.rate);
  piece.fast = hn::GetLane(pieces.fast), piece.slow = hn::GetLane(pieces.slow);
  piece.passed = hn::GetLane(pieces.passed);
  piece.k1 = hn::GetLane(pieces.k1), piece.k2 = 1 / poles.t2_ns, piece.k3 = k3;
  piece.length = length;
  return piece;
}

}  // namespace esim::inline event_camera
