#pragma once

#include "esim/core/vector_math.h"
#include "esim/event_camera/circuit/photoreceptor_noise.h"
#include "esim/event_camera/circuit/photoreceptor_signal.h"

// advance() of photoreceptor_signal.h and the steps of PhotoreceptorNoise for several pixels side by side.
// Private to .cpp files: includes hwy/highway.h.
namespace esim::inline event_camera {

inline constexpr double kSettled = 1e-13;  ///< brightness: differences below this are zero

/// CircuitState with L = light and y = light - ln(1 + lag).
template <class D>
struct CircuitStates {
  hn::Vec<D> light, lag, y, v, w;
};

/// CircuitPiece; k2 and k3 are those of all pixels.
template <class D>
struct CircuitPieces {
  hn::Vec<D> level, rate, fast, slow, k1, passed;
};

/// A change of the light over `length` ns, to `light1`: growth = light1 - L, rho = exp(growth) - 1, and rate0 = I / Q
/// at the start. Each decay is exp(-k length) of the pole of its number.
template <class D>
struct CircuitRamps {
  hn::Vec<D> light1, growth, rho, rate0, length, decay2, decay3;
};

/// The integral of I / Q over a ramp.
template <class D>
HWY_INLINE hn::Vec<D> area_of(D d, const CircuitRamps<D>& ramp) {
  const auto one = hn::Set(d, 1.0);
  const auto changes = hn::Ne(ramp.growth, hn::Zero(d));
  const auto mean = hn::IfThenElse(changes, hn::Div(ramp.rho, hn::IfThenElse(changes, ramp.growth, one)), one);
  return hn::Mul(hn::Mul(ramp.rate0, ramp.length), mean);
}

/// exponential_moments() of each area: psi_0 = (1 - exp(-a)) / a and a psi_k = 1 - k psi_{k-1}, which is stable upwards
/// for large a, downwards for small a.
template <class D>
HWY_INLINE std::array<hn::Vec<D>, 4> exponential_moments(D d, hn::Vec<D> area) {
  using V = hn::Vec<D>;
  const auto set = [d](double value) { return hn::Set(d, value); };
  const V one = set(1);
  constexpr double kLarge = 0.02;  // where the recursion upwards loses at most 11 digits in psi_3, which hardly counts
  const auto large = hn::Gt(area, set(kLarge));
  std::array<V, 4> moments{hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  if (!hn::AllTrue(d, large)) {
    const V a = hn::Min(area, set(kLarge)), a2 = hn::Mul(a, a);
    // Sum over j of (-a)^j 3! / (4 + j)!, odd and even powers apart
    constexpr auto kTerms = [] {
      std::array<double, 6> terms{0.25};
      for (std::size_t j = 1; j < terms.size(); ++j) terms[j] = -terms[j - 1] / static_cast<double>(4 + j);
      return terms;
    }();
    V even = set(kTerms[4]), odd = set(kTerms[5]);
    for (std::size_t j = 4; j >= 2; j -= 2) {
      even = hn::MulAdd(even, a2, set(kTerms[j - 2]));
      odd = hn::MulAdd(odd, a2, set(kTerms[j - 1]));
    }
    moments[3] = hn::MulAdd(odd, a, even);
    moments[2] = hn::Mul(hn::NegMulAdd(a, moments[3], one), set(1.0 / 3));
    moments[1] = hn::Mul(hn::NegMulAdd(a, moments[2], one), set(0.5));
    moments[0] = hn::NegMulAdd(a, moments[1], one);
  }
  if (!hn::AllFalse(d, large)) {
    const V a = hn::Max(area, set(kLarge)), inverse = hn::Div(one, a);
    const V p0 = hn::Mul(hn::Sub(one, hn::Exp(d, hn::Neg(a))), inverse), p1 = hn::Mul(hn::Sub(one, p0), inverse);
    const V p2 = hn::Mul(hn::NegMulAdd(set(2), p1, one), inverse);
    const V p3 = hn::Mul(hn::NegMulAdd(set(3), p2, one), inverse);
    moments[0] = hn::IfThenElse(large, p0, moments[0]), moments[1] = hn::IfThenElse(large, p1, moments[1]);
    moments[2] = hn::IfThenElse(large, p2, moments[2]), moments[3] = hn::IfThenElse(large, p3, moments[3]);
  }
  return moments;
}

/// exp(x) - 1 for |x| up to kMaxLightStep.
template <class D>
HWY_INLINE hn::Vec<D> exponential_minus_one(D d, hn::Vec<D> x) {
  auto sum = hn::Set(d, 1.0 / 3628800);
  for (const double term : {362880.0, 40320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0})
    sum = hn::MulAdd(sum, x, hn::Set(d, 1 / term));
  return hn::MulAdd(hn::Mul(sum, x), x, x);
}

/// ln(1 + x)
template <class D>
HWY_INLINE hn::Vec<D> logarithm_of_one_plus(D d, hn::Vec<D> x) {
  // For small x: 2 artanh(s), s = x / (2 + x) below 1 / 9
  const auto s = hn::Div(x, hn::Add(hn::Set(d, 2.0), x)), s2 = hn::Mul(s, s);
  auto sum = hn::Set(d, 2.0 / 15);
  for (const int k : {13, 11, 9, 7, 5, 3}) sum = hn::MulAdd(sum, s2, hn::Set(d, 2.0 / k));
  const auto logarithm = hn::MulAdd(hn::Mul(sum, s2), s, hn::Add(s, s));
  const auto small = hn::Lt(hn::Abs(x), hn::Set(d, 0.2));
  return hn::AllTrue(d, small) ? logarithm : hn::IfThenElse(small, logarithm, hn::Log1p(d, x));
}

/// Advances the states by ramps, and returns the signals on the way. `area` is that of area_of().
///
/// With a = integral of I / Q, in which I is linear: lag1 = (1 + rho) [lag0 exp(-A) + rho integral of
/// exp(-A (1 - x)) / (1 + rho x)^2 over x]. The quotient is replaced by a cubic through x = 0, 1/3, 2/3 and 1. Then
/// y = start + slope s + gap (exp(-k s) - 1), through y and its slope at the start and y at the end; at a resonance of
/// k with another pole, the quotients below would fail.
template <class D>
HWY_INLINE CircuitPieces<D> advance(D d, const CircuitPoles& poles, const CircuitRamps<D>& ramp, hn::Vec<D> area,
                                    CircuitStates<D>& state) {
  using V = hn::Vec<D>;
  const auto set = [d](double value) { return hn::Set(d, value); };
  const V one = set(1), light0 = state.light, lag0 = state.lag, y0 = state.y, v0 = state.v, in0 = hn::Sub(v0, state.w);
  const bool high_pass = poles.high_pass_per_ns > 0;

  const auto [p0, p1, p2, p3] = exponential_moments(d, area);
  const V decay = hn::NegMulAdd(area, p0, one);

  // The lag at the end
  const auto quotient = [&](double part) {
    const V g = hn::MulAdd(ramp.rho, set(part), one);
    return hn::Div(one, hn::Mul(g, g));
  };
  const V f1 = quotient(1.0 / 3), f2 = quotient(2.0 / 3), f3 = quotient(1.0);
  const auto sum = [&](double a, double b, double c, double e) {
    return hn::MulAdd(set(b), f1, hn::MulAdd(set(c), f2, hn::MulAdd(set(e), f3, set(a))));
  };
  const V c1 = sum(-5.5, 9, -4.5, 1), c2 = sum(9, -22.5, 18, -4.5), c3 = sum(-4.5, 13.5, -13.5, 4.5);
  const V integral = hn::MulAdd(c3, p3, hn::MulAdd(c2, p2, hn::MulAdd(c1, p1, p0)));
  const V grown = hn::Add(one, ramp.rho);
  V lag1 = hn::Mul(grown, hn::MulAdd(lag0, decay, hn::Mul(ramp.rho, integral)));
  lag1 = hn::IfThenElse(hn::Lt(hn::Abs(lag1), set(kSettled)), hn::Zero(d), lag1);
  const V y1 = hn::Sub(ramp.light1, logarithm_of_one_plus(d, lag1));

  // An exponential plus a line through y, and what the source follower makes of it
  const V slope0 = hn::Div(hn::Mul(ramp.rate0, lag0), hn::Add(one, lag0));
  const V a_plain = hn::Max(area, set(1e-3));
  const V per_length = hn::Div(one, ramp.length);
  const V t2 = set(poles.t2_ns);
  CircuitPieces<D> piece;
  piece.k1 = hn::Mul(a_plain, per_length);
  auto resonates = hn::Lt(hn::Abs(hn::MulSub(piece.k1, t2, one)), set(0.005));
  piece.k1 = hn::IfThenElse(resonates, set(1.005 / poles.t2_ns), piece.k1);
  const double k_2 = 1 / poles.t2_ns, k_3 = poles.high_pass_per_ns;
  if (high_pass) {
    const auto resonates3 = hn::Lt(hn::Abs(hn::Sub(piece.k1, set(k_3))), set(0.005 * k_3));
    piece.k1 = hn::IfThenElse(resonates3, set(1.005 * k_3), piece.k1);
    resonates = hn::Or(resonates, resonates3);
  }
  const V a = hn::Mul(piece.k1, ramp.length);
  const auto exact = hn::And(hn::Eq(a_plain, area), hn::Not(resonates));
  const V decay1 = hn::AllTrue(d, exact) ? decay : hn::IfThenElse(exact, decay, hn::Exp(d, hn::Neg(a)));
  const V mean_decay = hn::Div(hn::Sub(one, decay1), a);
  piece.rate =
      hn::Div(hn::NegMulAdd(slope0, mean_decay, hn::Mul(hn::Sub(y1, y0), per_length)), hn::Sub(one, mean_decay));
  const V gap = hn::Div(hn::Sub(piece.rate, slope0), piece.k1);
  piece.level = hn::Sub(hn::Sub(y0, gap), hn::Mul(piece.rate, t2));
  piece.fast = hn::Div(gap, hn::NegMulAdd(piece.k1, t2, one));
  piece.slow = hn::Sub(hn::Sub(v0, piece.level), piece.fast);
  piece.passed = hn::Zero(d);
  V v1 = hn::MulAdd(piece.slow, ramp.decay2,
                    hn::MulAdd(piece.fast, decay1, hn::MulAdd(piece.rate, ramp.length, piece.level)));
  const auto settles = hn::And(hn::And(hn::Eq(lag1, hn::Zero(d)), hn::Eq(light0, ramp.light1)),
                               hn::Lt(hn::Abs(hn::Sub(v1, y1)), set(kSettled)));
  v1 = hn::IfThenElse(settles, y1, v1);
  V w1 = state.w;
  if (high_pass) {
    piece.level = hn::Div(piece.rate, set(k_3));
    piece.rate = hn::Zero(d);
    piece.fast = hn::Div(hn::Mul(piece.fast, piece.k1), hn::Sub(piece.k1, set(k_3)));
    piece.slow = hn::Mul(piece.slow, set(k_2 / (k_2 - k_3)));
    piece.passed = hn::Sub(hn::Sub(hn::Sub(in0, piece.level), piece.fast), piece.slow);
    const V in1 = hn::MulAdd(piece.passed, ramp.decay3,
                             hn::MulAdd(piece.slow, ramp.decay2, hn::MulAdd(piece.fast, decay1, piece.level)));
    w1 = hn::IfThenElse(hn::And(settles, hn::Lt(hn::Abs(in1), set(kSettled))), v1, hn::Sub(v1, in1));
  }
  state = {ramp.light1, lag1, y1, v1, w1};
  return piece;
}

/// Pixels whose noise makes a step side by side.
using NoiseLanes = hn::CappedTag<float, 8>;

/// As step_length() and the ramp of this length, `rate` in 1/ns.
template <class D>
HWY_INLINE CircuitRamps<D> ramp_of_step(D d, const CircuitPoles& poles, hn::Vec<D> light, hn::Vec<D> lag,
                                        hn::Vec<D> rate, hn::Vec<D> length) {
  const auto set = [d](double value) { return hn::Set(d, value); };
  const auto one = set(1), zero = hn::Zero(d);
  const auto changes = hn::Mul(hn::Abs(hn::Mul(rate, length)), set(1 / kMaxLightStep));
  CircuitRamps<D> ramp;
  ramp.rate0 = hn::Mul(hn::Exp(d, light), set(1 / poles.t1_unit_ns));
  ramp.length = hn::Div(length, hn::Max(one, hn::Ceil(hn::Sub(changes, set(1e-9)))));
  const auto transient = hn::Abs(hn::Sub(lag, hn::Div(rate, ramp.rate0)));
  const auto far = hn::Gt(transient, set(kMaxTransient));
  if (!hn::AllFalse(d, far)) {
    const auto decay = hn::Div(set(kMaxDecay), hn::Sqrt(hn::Sqrt(hn::Min(one, transient))));
    const auto brightest = hn::Add(one, exponential_minus_one(d, hn::Max(zero, hn::Mul(rate, ramp.length))));
    const auto shorter = hn::Div(decay, hn::Mul(ramp.rate0, brightest));
    ramp.length = hn::IfThenElse(far, hn::Min(ramp.length, shorter), ramp.length);
  }
  ramp.growth = hn::Mul(rate, ramp.length);
  ramp.light1 = hn::Add(light, ramp.growth);
  ramp.rho = exponential_minus_one(d, ramp.growth);
  const double k3 = poles.high_pass_per_ns;
  ramp.decay2 = hn::Exp(d, hn::Mul(ramp.length, set(-1 / poles.t2_ns)));
  ramp.decay3 = k3 > 0 ? hn::Exp(d, hn::Mul(ramp.length, set(-k3))) : one;
  return ramp;
}

/// Signals as in CircuitPiece, plus leak and minus a reference, for comparisons that may fail by rounding errors:
/// `guard` is above all of them.
template <class D>
struct FloatSignals {
  using V = hn::Vec<D>;
  struct At {
    V time, value, fast, slow, passed;
  };
  V level, rate, fast, slow, passed, k1, k2, k3, guard;
  bool has_high_pass;

  HWY_INLINE void set_guard(D d, V length) {
    constexpr float kRounding = 5e-7F;
    const V terms = hn::Add(hn::Abs(level), hn::Abs(hn::Mul(rate, length)));
    guard =
        hn::Mul(hn::Set(d, kRounding), hn::Add(hn::Add(terms, hn::Abs(fast)), hn::Add(hn::Abs(slow), hn::Abs(passed))));
  }
  HWY_INLINE At at(D d, V time) const {
    const auto decayed = [&](V value, V per_ns) {
      return hn::NegMulAdd(value, moved_after(d, hn::Mul(per_ns, time)), value);
    };
    At at{time, level, decayed(fast, k1), decayed(slow, k2), has_high_pass ? decayed(passed, k3) : passed};
    at.value = hn::Add(hn::MulAdd(rate, time, level), hn::Add(hn::Add(at.fast, at.slow), at.passed));
    return at;
  }
  /// As CircuitPiece::range(a, b).
  HWY_INLINE std::pair<V, V> range(D d, const At& a, const At& b) const {
    const V size1 = hn::Abs(a.fast), size2 = hn::Abs(a.slow), size3 = hn::Abs(a.passed), span = hn::Sub(b.time, a.time);
    const V curvature =
        hn::MulAdd(hn::Mul(size1, k1), k1, hn::MulAdd(hn::Mul(size2, k2), k2, hn::Mul(hn::Mul(size3, k3), k3)));
    const V bent = hn::Mul(hn::Mul(curvature, hn::Set(d, 0.125F)), hn::Mul(span, span));
    const V beyond = hn::Add(guard, hn::Min(bent, hn::Add(hn::Add(size1, size2), size3)));
    return {hn::Sub(hn::Min(a.value, b.value), beyond), hn::Add(hn::Max(a.value, b.value), beyond)};
  }
};

/// Bounds of cubics from x0 to x1, which y0 and y1 pull with the time constant t2, after a third of their length:
/// `along` t2. A cubic lies between the control points of its Bezier curve.
template <class V>
HWY_INLINE std::pair<V, V> cubic_bounds(V y0, V x0, V y1, V x1, V along) {
  const V a = hn::MulAdd(hn::Sub(y0, x0), along, x0), b = hn::NegMulAdd(hn::Sub(y1, x1), along, x1);
  return {hn::Min(hn::Min(x0, x1), hn::Min(a, b)), hn::Max(hn::Max(x0, x1), hn::Max(a, b))};
}

/// A step of the noise from (y, x), as in PhotoreceptorNoise::Step: parabola(factor, i) is its c_i. Rounds in the same
/// way wherever it is used, since all products are part of a multiplication with addition or stand alone.
template <class D, class Parabola>
HWY_INLINE void noise_step(D d, const Parabola& parabola, hn::Vec<D> xx, hn::Vec<D> drift, hn::Vec<D> n1, hn::Vec<D> n2,
                           hn::Vec<D>& y, hn::Vec<D>& x) {
  static_cast<void>(d);
  using Step = PhotoreceptorNoise::Step;
  const auto factor = [&](std::size_t i) {
    return hn::MulAdd(drift, hn::MulAdd(drift, parabola(i, 2), parabola(i, 1)), parabola(i, 0));
  };
  x = hn::MulAdd(factor(Step::n_xx), n2,
                 hn::MulAdd(factor(Step::n_xy), n1, hn::MulAdd(factor(Step::xy), y, hn::Mul(xx, x))));
  y = hn::MulAdd(factor(Step::n_yy), n1, hn::Mul(factor(Step::yy), y));
}

}  // namespace esim::inline event_camera
