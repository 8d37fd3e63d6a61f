#include "esim/event_camera/pixel/relaxing_signals.h"

#include <algorithm>

#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

using F = hn::CappedTag<float, 8>;
using V = hn::Vec<F>;
using Mask = hn::Mask<F>;
constexpr F kF;

// Vectors of doubles, with half as many lanes.
using D = hn::Rebind<double, hn::Half<F>>;
constexpr D kD;

constexpr double kToleranceNs = 0.05;
constexpr int kMaxSteps = 3;

// Minimum distance of an extremum from the levels for floats to decide that it does not reach them.
constexpr float kTooClose = 1e-5F;

V set(float value) { return hn::Set(kF, value); }
V load(const PerPixel<float>& values, std::size_t i) { return hn::LoadU(kF, values.data() + i); }
hn::Vec<D> set_double(double value) { return hn::Set(kD, value); }
hn::Vec<D> load_double(const PerPixel<double>& values, std::size_t i) { return hn::LoadU(kD, values.data() + i); }

/// Conversion to doubles.
template <class To>
hn::Vec<To> promoted(To d, const PerPixel<float>& values, std::size_t i) {
  return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, To>(), values.data() + i));
}

/// filtered - reference, as floats.
V relative(const PerPixel<float>& filtered, const PerPixel<double>& reference, std::size_t i) {
  const auto part = [&](std::size_t k) {
    return hn::DemoteTo(hn::Half<F>(), hn::Sub(promoted(kD, filtered, k), load_double(reference, k)));
  };
  return hn::Combine(kF, part(i + hn::Lanes(kD)), part(i));
}

}  // namespace

void RelaxingSignals::take(const ActivePixels& active, std::size_t first, int poles, double duration) {
  active_ = &active;
  poles_ = poles;
  duration_ = duration;
  for (std::size_t i = first; i < active.count; ++i) {
    const float rise = (active.end[i] - active.start[i]) / active.phase[i],
                distance = active.start[i] - active.filtered1[i];
    rise_[i] = rise;
    u_[i] = moved_[i] = 0;
    value_[i] = static_cast<double>(active.filtered1[i]);
    end_[i] = active.filtered1[i] + (distance * active.moved[i] + rise * (active.phase[i] - active.moved[i]));
  }
  if (poles == 1) return;
  const Comparators none{};
  for (std::size_t i = first; i < active.count; ++i) {
    const RelaxingSignal one = signal(none, i);
    value_[i] = one.value();
    end_[i] = static_cast<float>(one.value(duration));
  }
}

RelaxingSignal RelaxingSignals::signal(const Comparators& c, std::size_t i) const {
  const ActivePixels& a = *active_;
  const double rate = a.phase[i] / duration_, slope = rise_[i] * rate;
  RelaxingSignal one =
      poles_ == 2 ? RelaxingSignal::second_order(rate, a.moved[i], a.filtered1[i], a.filtered2[i], a.start[i], slope)
                  : RelaxingSignal::first_order(rate, a.moved[i], a.filtered1[i], a.start[i], slope);
  one.add(0, c.drift[i]);
  if (c.from[i] > 0) one.advance(c.from[i]);
  return one;
}

void RelaxingSignals::copy(std::size_t i, std::size_t to) {
  for (auto* values : {&rise_, &u_, &moved_, &end_}) (*values)[to] = (*values)[i];
  value_[to] = value_[i];
}

/// Some neighbouring signals after one pole relative to their references, plus the drift, between `from` and the
/// segment's end. Their slope is monotone.
struct RelaxingSignals::Span {
  V filtered, distance, rise, drift;  // F at u = 0, its distance from the input; slopes of input and drift per u
  V first, last;                      // u at `from` and at the end
  V v0, v1, g0, g1;                   // the signal at both, and its slopes
  V upper, lower;

  Span(const RelaxingSignals& s, const Comparators& c, std::size_t i) {
    const ActivePixels& a = *s.active_;
    const V m0 = load(s.moved_, i), m1 = load(a.moved, i), start = load(a.start, i), f1 = load(a.filtered1, i);
    first = load(s.u_, i), last = load(a.phase, i);
    filtered = relative(a.filtered1, c.reference, i);
    distance = hn::Sub(start, f1), rise = load(s.rise_, i);
    const auto part = [&](std::size_t k) { return hn::DemoteTo(hn::Half<F>(), load_double(c.drift, k)); };
    drift =
        hn::Div(hn::Mul(hn::Combine(kF, part(i + hn::Lanes(kD)), part(i)), set(static_cast<float>(s.duration_))), last);
    v0 = value(first, m0), v1 = value(last, m1);
    g0 = slope(m0), g1 = slope(m1);
    upper = hn::Add(load(c.on, i), set(static_cast<float>(c.threshold_on)));
    lower = hn::Neg(hn::Add(load(c.off, i), set(static_cast<float>(c.threshold_off))));
  }

  V value(V u, V m) const {
    const V light = hn::MulAdd(distance, m, hn::Mul(rise, hn::Sub(u, m)));
    return hn::Add(filtered, hn::MulAdd(drift, u, light));
  }
  V slope(V m) const { return hn::Add(hn::MulAdd(hn::Sub(rise, distance), m, distance), drift); }
  V bend(V m) const { return hn::NegMulAdd(hn::Sub(rise, distance), m, hn::Sub(rise, distance)); }

  Mask between_levels(V value) const { return hn::And(hn::Lt(value, upper), hn::Gt(value, lower)); }

  /// The intersection of the tangents at both ends, which limits the signal.
  V farthest() const {
    const V u = hn::Div(hn::NegMulAdd(g1, hn::Sub(last, first), hn::Sub(v1, v0)), hn::Sub(g0, g1));
    return hn::MulAdd(g0, u, v0);
  }

  /// Whether the extremum, of signals whose slopes at the ends have different signs, is certainly between the levels.
  Mask turns_inside() const {
    const V m = hn::Div(hn::Add(distance, drift), hn::Sub(distance, rise));
    const V q = hn::Max(hn::Sub(set(1), m), set(1e-30F)), there = value(hn::Neg(logarithm(kF, q)), m);
    return hn::And(hn::Lt(there, hn::Sub(upper, set(kTooClose))), hn::Gt(there, hn::Add(lower, set(kTooClose))));
  }

  /// Approximate u at the crossing of `level`, for monotone signals: the inverse cubic through the ends.
  V guess_straight(V level) const {
    const V rises = hn::Sub(v1, v0), part = hn::Div(hn::Sub(level, v0), rises), left = hn::Sub(set(1), part);
    const V ends = hn::MulAdd(hn::Mul(hn::Mul(left, left), hn::MulAdd(set(2), part, set(1))), first,
                              hn::Mul(hn::Mul(hn::Mul(part, part), hn::NegMulAdd(set(2), part, set(3))), last));
    const V curvature = hn::Div(hn::NegMulAdd(part, g0, hn::Mul(left, g1)), hn::Mul(g0, g1));
    return hn::MulAdd(hn::Mul(hn::Mul(part, left), rises), curvature, ends);
  }

  /// The same for other signals: along the tangent at the end on that side of the extremum; does not overshoot.
  V guess_bent(V level, Mask on) const {
    const auto at_last = hn::Xor(on, hn::Lt(g1, set(0)));
    const V u = hn::IfThenElse(at_last, last, first), v = hn::IfThenElse(at_last, v1, v0);
    return hn::Add(u, hn::Div(hn::Sub(level, v), hn::IfThenElse(at_last, g1, g0)));
  }

  /// A step of Halley's method.
  V refined(V u, V level) const {
    const V m = moved_after(kF, u), miss = hn::Sub(value(u, m), level), g = slope(m);
    const V curved = hn::Mul(hn::Mul(miss, set(0.5F)), bend(m));
    return hn::Sub(u, hn::Div(hn::Mul(miss, g), hn::MulSub(g, g, curved)));
  }
};

/// Decides which signals leave their levels, and approximately when, or that it is unclear.
void RelaxingSignals::guess(Comparators& c) {
  std::size_t unclear_count = 0;
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(kF)) {
    const Span s(*this, c, i);
    const auto on = hn::Ge(s.v1, s.upper), off = hn::Le(s.v1, s.lower), crosses = hn::Or(on, off);
    const auto straight = hn::Gt(hn::Mul(s.g0, s.g1), set(0));
    // With an extremum, a signal may leave through one level before the other. Then, or if it is outside, it is
    // unclear.
    const V farthest = s.farthest();
    const auto early_on = hn::AndNot(on, hn::Ge(farthest, s.upper)),
               early_off = hn::AndNot(off, hn::Le(farthest, s.lower));
    auto doubtful = hn::AndNot(straight, hn::Or(early_on, early_off));
    if (!hn::AllFalse(kF, doubtful)) doubtful = hn::AndNot(s.turns_inside(), doubtful);
    const auto unclear = hn::Or(doubtful, hn::Not(s.between_levels(s.v0)));

    const V level = hn::IfThenElse(on, s.upper, s.lower);
    V u = hn::IfThenElse(straight, s.guess_straight(level), s.guess_bent(level, on));
    u = hn::Min(hn::Max(u, s.first), s.last);
    u = hn::Min(hn::Max(s.refined(u, level), s.first), s.last);
    hn::StoreU(u, kF, guess_.data() + i);
    const V polarity = hn::IfThenElseZero(crosses, hn::IfThenElse(on, set(1), set(-1)));
    hn::StoreU(hn::PromoteTo(kD, hn::LowerHalf(hn::Half<F>(), polarity)), kD, c.polarity.data() + i);
    hn::StoreU(hn::PromoteTo(kD, hn::UpperHalf(hn::Half<F>(), polarity)), kD, c.polarity.data() + i + hn::Lanes(kD));
    const ChosenLanes chosen(kF, unclear);
    chosen.store_positions(static_cast<std::uint32_t>(i), unclear_.data() + unclear_count);
    unclear_count += chosen.count();
  }
  unclear_count_ = unclear_count;
}

/// Computes the crossings from the approximations, by one or a few steps of Halley's method in doubles.
void RelaxingSignals::solve(Comparators& c) {
  const ActivePixels& a = *active_;
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(kD)) {
    const auto polarity = load_double(c.polarity, i), zero = set_double(0);
    const auto last = promoted(kD, a.phase, i), per_u = hn::Div(set_double(duration_), last);
    const auto drift = hn::Mul(load_double(c.drift, i), per_u), first = promoted(kD, u_, i);
    const auto f1 = promoted(kD, a.filtered1, i), rise = promoted(kD, rise_, i);
    const auto distance = hn::Sub(promoted(kD, a.start, i), f1), steepens = hn::Sub(rise, distance);
    const auto upper = hn::Add(promoted(kD, c.on, i), set_double(c.threshold_on));
    const auto lower = hn::Add(promoted(kD, c.off, i), set_double(c.threshold_off));
    const auto level = hn::IfThenElse(hn::Gt(polarity, zero), upper, hn::Neg(lower));
    const auto above = hn::Sub(hn::Sub(f1, load_double(c.reference, i)), level);
    const auto tolerance = hn::Mul(set_double(kToleranceNs / duration_), last);

    const auto idle = hn::Eq(polarity, zero);
    auto u = hn::IfThenElse(idle, first, promoted(kD, guess_, i));
    auto found = idle;
    for (int step = 0; step < kMaxSteps; ++step) {
      const auto m = precisely_moved_after(kD, u);
      const auto light = hn::MulAdd(distance, m, hn::Mul(rise, hn::Sub(u, m)));
      const auto miss = hn::Add(above, hn::MulAdd(drift, u, light));
      const auto slope = hn::Add(hn::MulAdd(steepens, m, distance), drift), bend = hn::NegMulAdd(steepens, m, steepens);
      const auto slope2 = hn::Mul(slope, slope), curved = hn::Mul(hn::Mul(miss, set_double(0.5)), bend);
      auto next = hn::Sub(u, hn::Div(hn::Mul(miss, slope), hn::Sub(slope2, curved)));
      next = hn::Min(hn::Max(next, first), last);
      // The next step would be about the cube of this one, times a factor that depends on the curvature.
      const auto moved = hn::Abs(hn::Sub(next, u)), cube = hn::Mul(moved, hn::Mul(moved, moved));
      const auto precise = hn::Le(hn::Mul(cube, hn::MulAdd(bend, bend, slope2)), hn::Mul(tolerance, slope2));
      u = hn::IfThenElse(found, u, next);  // no lane depends on the others
      found = hn::Or(found, precise);
      if (hn::AllTrue(kD, found)) [[likely]]
        break;
    }
    hn::StoreU(hn::Mul(u, per_u), kD, c.tau.data() + i);
    if (hn::AllTrue(kD, found)) [[likely]]
      continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(kD, found, bits);
    for (std::size_t k = 0; k < hn::Lanes(kD); ++k) {
      if ((bits[0] >> k & 1U) == 0 && i + k < c.count) find_one(c, i + k);
    }
  }
}

void RelaxingSignals::find_one(Comparators& c, std::size_t i) const {
  const Crossing crossing = signal(c, i).first_crossing(duration_, c.lower(i), c.upper(i));
  c.polarity[i] = crossing.tau == kNever ? 0.0 : (crossing.on ? 1.0 : -1.0);
  if (crossing.tau != kNever) c.tau[i] = crossing.tau;
}

void RelaxingSignals::find(Comparators& c) {
  if (poles_ == 2) {
    for (std::size_t i = 0; i < c.count; ++i) find_one(c, i);
    return;
  }
  guess(c);
  solve(c);
  for (std::size_t k = 0; k < unclear_count_; ++k) {
    if (unclear_[k] < c.count) find_one(c, unclear_[k]);
  }
}

/// Processes one vector of signals.
template <class D>
void RelaxingSignals::advance(D d, const Comparators& c, std::size_t i) {
  const ActivePixels& a = *active_;
  const hn::Rebind<float, D> narrow;
  const auto start = promoted(d, a.start, i), f1 = promoted(d, a.filtered1, i), rise = promoted(d, rise_, i);
  const auto part = hn::Mul(hn::LoadU(d, c.from.data() + i), hn::Set(d, 1 / duration_));
  const auto u = hn::Mul(part, promoted(d, a.phase, i)), m = precisely_moved_after(d, u);
  const auto value = hn::Add(f1, hn::MulAdd(hn::Sub(start, f1), m, hn::Mul(rise, hn::Sub(u, m))));
  hn::StoreU(value, d, value_.data() + i);
  hn::StoreU(hn::DemoteTo(narrow, u), narrow, u_.data() + i);
  hn::StoreU(hn::DemoteTo(narrow, m), narrow, moved_.data() + i);
}

void RelaxingSignals::advance(const Comparators& c, std::size_t i) {
  if (poles_ == 1) {
    advance(hn::CappedTag<double, 1>(), c, i);
  } else {
    value_[i] = signal(c, i).value() - c.drift[i] * c.from[i];
  }
}

void RelaxingSignals::advance(const Comparators& c) {
  if (poles_ == 2) {
    for (std::size_t i = 0; i < c.count; ++i) advance(c, i);
    return;
  }
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(kD)) advance(kD, c, i);
}

void RelaxingSignals::look_ahead(const Comparators& c, double* again) const {
  if (poles_ == 2) {  // they may have two extrema
    std::fill_n(again, c.count, 1.0);
    return;
  }
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(kF)) {
    const Span s(*this, c, i);
    const auto straight = hn::Gt(hn::Mul(s.g0, s.g1), set(0));
    const auto stays = hn::And(s.between_levels(s.v1), hn::Or(straight, s.between_levels(s.farthest())));
    const V may = hn::IfThenZeroElse(stays, set(1));
    hn::StoreU(hn::PromoteTo(kD, hn::LowerHalf(hn::Half<F>(), may)), kD, again + i);
    hn::StoreU(hn::PromoteTo(kD, hn::UpperHalf(hn::Half<F>(), may)), kD, again + i + hn::Lanes(kD));
  }
}

}  // namespace esim::inline event_camera
