// RelaxingSignal, many at once.
#include <algorithm>
#include <array>
#include <cmath>

#include "esim/sensors/pixel_signal.h"
#include "esim/sensors/vector_math.h"

namespace esim {
namespace {

using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
constexpr D kD;
constexpr std::size_t kMaxLanes = HWY_MAX_BYTES / sizeof(double);

constexpr double kToleranceNs = 0.05;
constexpr int kMostSteps = 3;

// Below, 1 - exp(-u) loses too many digits.
constexpr double kSmallestSpan = 1e-4;

using Values = std::array<double, kMaxLanes>;

V load(const Values& values) { return hn::LoadU(kD, values.data()); }
V set(double value) { return hn::Set(kD, value); }

}  // namespace

/// As many signals as a vector has lanes, one value of each beside the other.
struct RelaxingSignal::Lanes {
  alignas(64) Values rate, start, rise, filtered, offset, drift, moved, u, value, slope, low, high;

  void take(std::size_t lane, const RelaxingSignal& s, double low_level, double high_level) {
    rate[lane] = s.rate_, start[lane] = s.start_, rise[lane] = s.rise_, filtered[lane] = s.filtered1_;
    offset[lane] = s.offset_, drift[lane] = s.drift_, moved[lane] = s.moved_;
    u[lane] = s.at_from_.u, value[lane] = s.at_from_.value, slope[lane] = s.at_from_.slope;
    low[lane] = low_level, high[lane] = high_level;
  }

  /// Value without what leaks, of one pole.
  V filtered_at(V u_now, V m) const {
    const V f = load(filtered);
    return hn::Add(hn::MulAdd(hn::Sub(load(start), f), m, f), hn::Mul(load(rise), hn::Sub(u_now, m)));
  }

  /// Where the signal turns back, is that between the levels, and before `last`?
  hn::Mask<D> turns_inside(V last, V upper, V lower) const {
    const V leak = load(drift), distance = hn::Sub(load(start), load(filtered));
    const V m = hn::Div(hn::Add(distance, leak), hn::Sub(distance, load(rise)));
    const V turn = hn::Neg(hn::Log(kD, hn::Max(hn::Sub(set(1), m), set(1e-300))));
    const V value_there = hn::Add(hn::MulAdd(leak, turn, load(offset)), filtered_at(turn, m));
    const auto inside = hn::And(hn::Lt(value_there, upper), hn::Gt(value_there, lower));
    return hn::And(inside, hn::And(hn::Gt(turn, load(u)), hn::Lt(turn, last)));
  }

  enum Outcome : int { kNone = 0, kOn = 1, kOff = 2, kUnclear = 3 };

  /// For each lane, what happens until `end`, and when. Unclear is what turns back before it crosses, is outside
  /// already, or is not found with a few steps of Halley's method from the inverse cubic.
  void find(double end, Values& outcome, Values& tau) const {
    const V first = load(u), last = hn::Mul(load(rate), set(end)), v0 = load(value), g0 = load(slope);
    const V leak = load(drift), shift = load(offset);
    const V f_last = filtered_at(last, load(moved));
    const V v1 = hn::Add(hn::MulAdd(leak, last, shift), f_last);
    const V g1 = hn::Add(hn::Sub(hn::MulAdd(load(rise), last, load(start)), f_last), leak);
    const V upper = load(high), lower = load(low);
    const auto on = hn::Ge(v1, upper), off = hn::Le(v1, lower), crosses = hn::Or(on, off);
    const auto straight = hn::Gt(hn::Mul(g0, g1), hn::Zero(kD));
    auto clear = straight;
    if (const auto bent = hn::Not(hn::Or(straight, crosses)); !hn::AllFalse(kD, bent)) {
      clear = hn::Or(clear, hn::And(bent, turns_inside(last, upper, lower)));
    }
    clear = hn::And(clear, hn::And(hn::Lt(v0, upper), hn::Gt(v0, lower)));

    // The inverse cubic.
    const V level = hn::IfThenElse(on, upper, lower), rises = hn::Sub(v1, v0);
    const V s = hn::Div(hn::Sub(level, v0), rises), t = hn::Sub(set(1), s);
    const V ends = hn::MulAdd(hn::Mul(hn::Mul(t, t), hn::MulAdd(set(2), s, set(1))), first,
                              hn::Mul(hn::Mul(hn::Mul(s, s), hn::NegMulAdd(set(2), s, set(3))), last));
    const V bow = hn::Sub(hn::Div(t, g0), hn::Div(s, g1));
    V guess = hn::MulAdd(hn::Mul(hn::Mul(s, t), rises), bow, ends);
    guess = hn::Min(hn::Max(guess, first), last);

    // Halley's method, as far as all lanes that matter need it.
    const auto wanted = hn::And(hn::And(clear, crosses), hn::Gt(last, set(kSmallestSpan)));
    auto found = hn::Not(wanted);
    V next = guess;
    for (int i = 0; i < kMostSteps && !hn::AllTrue(kD, found); ++i) {
      guess = next;
      const V m = hn::Sub(set(1), hn::Exp(kD, hn::Neg(guess)));
      const V f = filtered_at(guess, m), own = hn::Sub(hn::MulAdd(load(rise), guess, load(start)), f);
      const V g = hn::Add(own, leak), miss = hn::Sub(hn::Add(hn::MulAdd(leak, guess, shift), f), level);
      const V newton = hn::Div(miss, g), bend = hn::Div(hn::Sub(load(rise), own), g);
      next = hn::Sub(guess, hn::Div(newton, hn::NegMulAdd(hn::Mul(set(0.5), newton), bend, set(1))));
      next = hn::Min(hn::Max(next, first), last);
      // The next step would be about this one cubed, times what the bend makes of it.
      const V step = hn::Abs(hn::Sub(next, guess)), cube = hn::Mul(step, hn::Mul(step, step));
      const V left = hn::Mul(cube, hn::MulAdd(bend, bend, set(1)));
      found = hn::Or(found, hn::Le(left, hn::Mul(load(rate), set(kToleranceNs))));
    }
    clear = hn::And(hn::And(clear, found), hn::Or(wanted, hn::Not(crosses)));

    V what = hn::IfThenElse(on, set(kOn), hn::IfThenElse(off, set(kOff), set(kNone)));
    what = hn::IfThenElse(clear, what, set(kUnclear));
    hn::StoreU(what, kD, outcome.data());
    hn::StoreU(hn::Div(next, load(rate)), kD, tau.data());
  }
};

void RelaxingSignal::first_crossings(std::span<const RelaxingSignal> signals, double end, const double* low,
                                     const double* high, Crossing* crossings) {
  const std::size_t lanes = hn::Lanes(kD);
  Lanes block;
  Values outcome, tau;
  for (std::size_t i = 0; i < signals.size(); i += lanes) {
    const std::size_t count = std::min(lanes, signals.size() - i);
    for (std::size_t k = 0; k < lanes; ++k) {
      const std::size_t from = i + std::min(k, count - 1);  // fills the last vector up
      block.take(k, signals[from], low[from], high[from]);
    }
    block.find(end, outcome, tau);
    for (std::size_t k = 0; k < count; ++k) {
      const RelaxingSignal& signal = signals[i + k];
      const int what = static_cast<int>(outcome[k]);
      if (what == Lanes::kUnclear || signal.two_poles_) [[unlikely]] {
        crossings[i + k] = signal.first_crossing(end, low[i + k], high[i + k]);
      } else {
        crossings[i + k] = {what == Lanes::kNone ? kNever : tau[k], what == Lanes::kOn};
      }
    }
  }
}

void RelaxingSignal::advance(std::span<RelaxingSignal> signals, const double* tau) {
  const std::size_t lanes = hn::Lanes(kD);
  alignas(64) Values u{}, fade;
  for (std::size_t i = 0; i < signals.size(); i += lanes) {
    const std::size_t count = std::min(lanes, signals.size() - i);
    for (std::size_t k = 0; k < count; ++k) u[k] = signals[i + k].rate_ * tau[i + k];
    hn::StoreU(hn::Exp(kD, hn::Neg(load(u))), kD, fade.data());
    for (std::size_t k = 0; k < count; ++k) {
      RelaxingSignal& signal = signals[i + k];
      signal.at_from_ = u[k] > kSmallestSpan ? signal.at(u[k], 1 - fade[k]) : signal.at(u[k]);
    }
  }
}

}  // namespace esim
