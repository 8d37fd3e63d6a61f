#include "esim/sensors/relaxing_signals.h"

#include <algorithm>
#include <cstdint>

#include "esim/sensors/vector_math.h"

namespace esim {
namespace {

using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
constexpr D kD;

constexpr double kToleranceNs = 0.05;
constexpr int kMostSteps = 3;

// Below, 1 - exp(-u) loses too many digits.
constexpr double kSmallestSpan = 1e-5;

V set(double value) { return hn::Set(kD, value); }

/// F behind one pole.
V filtered_at(V u, V m, V filtered, V start, V rise) {
  return hn::Add(hn::MulAdd(hn::Sub(start, filtered), m, filtered), hn::Mul(rise, hn::Sub(u, m)));
}

}  // namespace

void RelaxingSignals::take(const AwakePixels& awake, int poles, double duration) {
  poles_ = poles;
  duration_ = duration;
  const auto fill = [&](const PerPixel<float>& from, PerPixel<double>& to) {
    for (std::size_t i = 0; i < awake.count; ++i) to[i] = from[i];
  };
  fill(awake.phase, phase_), fill(awake.moved, moved_);
  fill(awake.start, start_), fill(awake.filtered1, filtered1_);
  if (poles == 2) fill(awake.filtered2, filtered2_);
  for (std::size_t i = 0; i < awake.count; ++i) {
    const double end = awake.end[i], rise = (end - start_[i]) / phase_[i], distance = start_[i] - filtered1_[i];
    rise_[i] = rise;
    u_[i] = 0, value_[i] = filtered1_[i], slope_[i] = distance;
    end_[i] = filtered1_[i] + distance * moved_[i] + rise * (phase_[i] - moved_[i]);
    end_slope_[i] = end - end_[i];
  }
  if (poles == 1) return;
  Comparators none;
  for (std::size_t i = 0; i < awake.count; ++i) {
    none.leak[i] = 0, none.from[i] = 0;
    RelaxingSignal one = signal(none, i);
    value_[i] = one.value(), slope_[i] = one.slope();
    one.advance(duration);
    end_[i] = one.value(), end_slope_[i] = one.slope();
  }
}

RelaxingSignal RelaxingSignals::signal(const Comparators& c, std::size_t i) const {
  const double rate = phase_[i] / duration_, slope = rise_[i] * rate;
  RelaxingSignal one =
      poles_ == 2 ? RelaxingSignal::second_order(rate, moved_[i], filtered1_[i], filtered2_[i], start_[i], slope)
                  : RelaxingSignal::first_order(rate, moved_[i], filtered1_[i], start_[i], slope);
  one.add(0, c.leak[i]);
  if (c.from[i] > 0) one.advance(c.from[i]);
  return one;
}

void RelaxingSignals::copy(std::size_t i, std::size_t to) {
  for (auto* values :
       {&phase_, &start_, &rise_, &filtered1_, &filtered2_, &moved_, &u_, &value_, &slope_, &end_, &end_slope_}) {
    (*values)[to] = (*values)[i];
  }
}

/// Some neighbouring signals of one pole, as many as a vector has lanes.
struct RelaxingSignals::Finder {
  V filtered, start, rise, leak, first, last;  // leak is per u

  V level_at(V u, V m) const { return hn::MulAdd(leak, u, filtered_at(u, m, filtered, start, rise)); }

  /// Where the signal turns back, is that between the levels, and between first and last?
  hn::Mask<D> turns_inside(V upper, V lower) const {
    const V distance = hn::Sub(start, filtered);
    const V m = hn::Div(hn::Add(distance, leak), hn::Sub(distance, rise));
    const V turn = hn::Neg(hn::Log(kD, hn::Max(hn::Sub(set(1), m), set(1e-300))));
    const V value_there = level_at(turn, m);
    const auto inside = hn::And(hn::Lt(value_there, upper), hn::Gt(value_there, lower));
    return hn::And(inside, hn::And(hn::Gt(turn, first), hn::Lt(turn, last)));
  }

  /// Where the signal passes `level`, by a few steps of Halley's method from `guess`, where `wanted`. Clears `wanted`
  /// where that was not found.
  V halley(V guess, V level, V tolerance, hn::Mask<D>& wanted) const {
    auto found = hn::Not(wanted);
    V u = guess;
    for (int i = 0; i < kMostSteps && !hn::AllTrue(kD, found); ++i) {
      const V m = hn::Sub(set(1), hn::Exp(kD, hn::Neg(u)));
      const V f = filtered_at(u, m, filtered, start, rise), own = hn::Sub(hn::MulAdd(rise, u, start), f);
      const V slope = hn::Add(own, leak), miss = hn::Sub(hn::MulAdd(leak, u, f), level);
      const V per_slope = hn::Div(set(1), slope);
      const V newton = hn::Mul(miss, per_slope), bend = hn::Mul(hn::Sub(rise, own), per_slope);
      V next = hn::Sub(u, hn::Div(newton, hn::NegMulAdd(hn::Mul(set(0.5), newton), bend, set(1))));
      next = hn::Min(hn::Max(next, first), last);
      // The next step would be about this one cubed, times what the bend makes of it.
      const V step = hn::Abs(hn::Sub(next, u)), cube = hn::Mul(step, hn::Mul(step, step));
      const V left = hn::Mul(cube, hn::MulAdd(bend, bend, set(1)));
      u = hn::IfThenElse(found, u, next);  // no lane depends on its neighbours
      found = hn::Or(found, hn::Le(left, tolerance));
    }
    wanted = hn::And(wanted, found);
    return u;
  }
};

void RelaxingSignals::find(Comparators& c) const {
  const auto at = [](const auto& values, std::size_t i) { return hn::LoadU(kD, values.data() + i); };
  const auto thresholds = [](const PerPixel<float>& above, std::size_t i, double threshold) {
    return hn::Add(hn::PromoteTo(kD, hn::LoadU(hn::Rebind<float, D>(), above.data() + i)), set(threshold));
  };
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(kD)) {
    const V last = at(phase_, i), per_u = hn::Div(set(duration_), last), leak = hn::Mul(at(c.leak, i), per_u);
    const Finder s{at(filtered1_, i), at(start_, i), at(rise_, i), leak, at(u_, i), last};
    const V reference = at(c.reference, i);
    const V upper = hn::Add(reference, thresholds(c.on, i, c.threshold_on));
    const V lower = hn::Sub(reference, thresholds(c.off, i, c.threshold_off));
    const V v0 = hn::MulAdd(leak, s.first, at(value_, i)), v1 = hn::MulAdd(leak, last, at(end_, i));
    const V g0 = hn::Add(at(slope_, i), leak), g1 = hn::Add(at(end_slope_, i), leak);
    const auto on = hn::Ge(v1, upper), off = hn::Le(v1, lower), crosses = hn::Or(on, off);

    // Unclear is what turns back before it crosses, is outside already, or is not found in a few steps.
    const auto straight = hn::Gt(hn::Mul(g0, g1), hn::Zero(kD));
    auto clear = straight;
    if (const auto bent = hn::Not(hn::Or(straight, crosses)); !hn::AllFalse(kD, bent)) {
      clear = hn::Or(clear, hn::And(bent, s.turns_inside(upper, lower)));
    }
    clear = hn::And(clear, hn::And(hn::Lt(v0, upper), hn::Gt(v0, lower)));
    auto wanted = hn::And(hn::And(clear, crosses), hn::Gt(last, set(kSmallestSpan)));

    // Begin at the inverse cubic through the ends.
    const V level = hn::IfThenElse(on, upper, lower), rises = hn::Sub(v1, v0);
    const V part = hn::Div(hn::Sub(level, v0), rises), left = hn::Sub(set(1), part);
    const V ends = hn::MulAdd(hn::Mul(hn::Mul(left, left), hn::MulAdd(set(2), part, set(1))), s.first,
                              hn::Mul(hn::Mul(hn::Mul(part, part), hn::NegMulAdd(set(2), part, set(3))), last));
    const V bow = hn::Div(hn::NegMulAdd(part, g0, hn::Mul(left, g1)), hn::Mul(g0, g1));
    const V guess = hn::MulAdd(hn::Mul(hn::Mul(part, left), rises), bow, ends);
    const V tolerance = hn::Mul(set(kToleranceNs / duration_), last);
    const V u = s.halley(hn::Min(hn::Max(guess, s.first), last), level, tolerance, wanted);
    clear = hn::And(clear, hn::Or(wanted, hn::Not(crosses)));

    hn::StoreU(hn::Mul(u, per_u), kD, c.tau.data() + i);
    const V polarity = hn::IfThenElseZero(crosses, hn::IfThenElse(on, set(1), set(-1)));
    hn::StoreU(polarity, kD, c.polarity.data() + i);
    if (hn::AllTrue(kD, clear) && poles_ == 1) [[likely]]
      continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(kD, clear, bits);
    for (std::size_t k = i; k < std::min(i + hn::Lanes(kD), c.count); ++k) {
      if (poles_ == 1 && (bits[0] >> (k - i) & 1U) != 0) continue;
      const Crossing crossing = signal(c, k).first_crossing(duration_, c.lower(k), c.upper(k));
      c.polarity[k] = crossing.tau == kNever ? 0.0 : (crossing.on ? 1.0 : -1.0);
      if (crossing.tau != kNever) c.tau[k] = crossing.tau;
    }
  }
}

void RelaxingSignals::advance(const Comparators& c, std::size_t i) {
  const RelaxingSignal one = signal(c, i);
  u_[i] = c.from[i] * phase_[i] / duration_;
  value_[i] = one.value() - c.leak[i] * c.from[i];
  slope_[i] = one.slope() - c.leak[i] * duration_ / phase_[i];
}

void RelaxingSignals::advance(const Comparators& c) {
  if (poles_ == 2) {
    for (std::size_t i = 0; i < c.count; ++i) advance(c, i);
    return;
  }
  const auto at = [](const auto& values, std::size_t i) { return hn::LoadU(kD, values.data() + i); };
  const V per_duration = set(1 / duration_);
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(kD)) {
    const V u = hn::Mul(hn::Mul(at(c.from, i), per_duration), at(phase_, i));
    const V m = hn::Sub(set(1), hn::Exp(kD, hn::Neg(u))), start = at(start_, i), rise = at(rise_, i);
    const V value = filtered_at(u, m, at(filtered1_, i), start, rise);
    hn::StoreU(u, kD, u_.data() + i);
    hn::StoreU(value, kD, value_.data() + i);
    hn::StoreU(hn::Sub(hn::MulAdd(rise, u, start), value), kD, slope_.data() + i);
    const auto small = hn::And(hn::Gt(u, hn::Zero(kD)), hn::Lt(u, set(kSmallestSpan)));
    if (hn::AllFalse(kD, small)) [[likely]]
      continue;
    for (std::size_t k = i; k < std::min(i + hn::Lanes(kD), c.count); ++k) {
      if (u_[k] > 0 && u_[k] < kSmallestSpan) advance(c, k);
    }
  }
}

void RelaxingSignals::look_ahead(const Comparators& c, double* again) const {
  const bool may_turn_twice = poles_ == 2;
#pragma omp simd
  for (std::size_t i = 0; i < c.count; ++i) {
    const double drift = c.leak[i] * duration_ / phase_[i], last = end_[i] + c.leak[i] * duration_;
    const bool outside = last >= c.upper(i) || last <= c.lower(i);
    const bool turns = !((slope_[i] + drift) * (end_slope_[i] + drift) > 0);
    again[i] = outside || turns || may_turn_twice ? 1.0 : 0.0;
  }
}

}  // namespace esim
