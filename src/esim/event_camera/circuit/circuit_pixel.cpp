#include "esim/event_camera/circuit/circuit_pixel.h"

#include "esim/core/vector_math.h"

namespace esim::inline event_camera {
namespace {

// Of the times at which a signal without noise crosses a level, and at which noise begins to matter.
constexpr double kResolution_ns = 0.25, kNoiseResolution_ns = 0.05;

constexpr double kRestingDeviations = 3.5;

/// exp() of several values side by side.
void exponentials(std::array<double, 4>& values) {
  const hn::CappedTag<double, 4> d;
  for (std::size_t i = 0; i < values.size(); i += hn::Lanes(d))
    hn::StoreU(hn::Exp(d, hn::LoadU(d, &values[i])), d, &values[i]);
}

}  // namespace

SignalAt CircuitPixel::at(double s) const {
  std::array<double, 4> e{-piece_.k1 * s, -piece_.k2 * s, -piece_.k3 * s, light(s)};
  exponentials(e);
  SignalAt at{s, 0, 0, piece_.fast * e[0], piece_.slow * e[1], piece_.passed * e[2], e[3]};
  at.value = piece_.level + piece_.rate * s + at.fast + at.slow + at.passed + leaked(s);
  at.slope = piece_.rate - at.fast * piece_.k1 - at.slow * piece_.k2 - at.passed * piece_.k3 + leak_.rate;
  return at;
}

CircuitPixel::Reach CircuitPixel::reach(const SignalAt& a) const {
  if (noise_ == nullptr) return {};
  const double t2_per_t1 = a.brightness * circuit_.poles.t2_ns / circuit_.poles.t1_unit_ns;
  const double fraction = 1 / (1 + t2_per_t1);
  const double value = kActiveDeviations * gain_ * std::sqrt(noise_->variance() * fraction);
  return {value, -0.5 * value * (1 - fraction) * light_.rate};
}

/// The first time between a and b at which the signal is so near to a threshold that the noise matters; without noise,
/// at which it reaches the threshold.
std::optional<double> CircuitPixel::find_near(const SignalAt& a, const SignalAt& b) const {
  const double reach_a = reach(a).value, reach_b = reach(b).value;
  // The reach of the noise falls with rising light, so that it is maximal at one of the ends.
  const double beyond = beyond_chord(a, b) + std::max(reach_a, reach_b);
  if (std::max(a.value, b.value) + beyond < upper() && std::min(a.value, b.value) - beyond > lower())
    return std::nullopt;
  if (a.value + reach_a >= upper() || a.value - reach_a <= lower()) return a.s;
  const bool near_b = b.value + reach_b >= upper() || b.value - reach_b <= lower();
  if (b.s - a.s <= (noise_ == nullptr ? kResolution_ns : kNoiseResolution_ns))
    return near_b ? std::optional(b.s) : std::nullopt;
  if (near_b && is_monotone(a, b)) return solve_near(a, b);
  const SignalAt middle = at(0.5 * (a.s + b.s));
  if (const auto found = find_near(a, middle)) return found;
  return find_near(middle, b);
}

/// The same if the signal is monotone, near a threshold at b and not at a.
double CircuitPixel::solve_near(const SignalAt& a, const SignalAt& b) const {
  const auto distance = [&](const SignalAt& here) {
    const double above = upper() - here.value, below = here.value - lower();
    const Reach reach = this->reach(here);
    return Reach{std::min(above, below) - reach.value, (above < below ? -here.slope : here.slope) - reach.slope};
  };
  const double resolution = noise_ == nullptr ? kResolution_ns : kNoiseResolution_ns;
  double from = a.s, to = b.s;
  const double at_from = distance(a).value;
  double s = from + (to - from) * at_from / (at_from - distance(b).value);
  // Newton's method, with bisection where it would leave the part that contains the root. Its error after a step is
  // about the step's square divided by the length of the part.
  const double enough = std::sqrt(0.5 * resolution * (to - from));
  for (int i = 0; i < 60 && to - from > resolution; ++i) {
    const Reach here = distance(at(s));
    (here.value <= 0 ? to : from) = s;
    const double next = s - here.value / here.slope, last = s;
    s = next >= from && next <= to ? next : 0.5 * (from + to);
    if (std::abs(s - last) < enough && s == next) break;
  }
  return s;
}

std::optional<CircuitCrossing> CircuitPixel::find_crossing(const SignalAt& a, const SignalAt& b) const {
  const auto [low, high] = noise_->bounds(state_.from, state_.to, state_.pole);
  const double beyond = beyond_chord(a, b);
  if (std::min(a.value, b.value) - beyond + gain_ * low > lower() &&
      std::max(a.value, b.value) + beyond + gain_ * high < upper())
    return std::nullopt;
  const double start = state_.node_time - start_, length = noise_->part_ns(state_.pole);
  const PhotoreceptorNoise::Path& path = this->path();
  std::array<double, 4> ratio{-piece_.k1 * length, -piece_.k2 * length, -piece_.k3 * length, 0};
  bool has_ratio = false;
  const auto first = std::max(0.0, std::floor((a.s - start) / length));
  SignalAt from = a;
  for (auto i = static_cast<std::size_t>(first); i < PhotoreceptorNoise::kParts && from.s < b.s; ++i) {
    const double part_start = start + static_cast<double>(i) * length, end = part_start + length;
    SignalAt to = b;
    if (end < b.s && i + 1 < PhotoreceptorNoise::kParts) {
      if (end - from.s < 0.99 * length) {
        to = at(end);
      } else {
        if (!has_ratio) exponentials(ratio), has_ratio = true;
        to.s = end;
        to.fast = from.fast * ratio[0], to.slow = from.slow * ratio[1], to.passed = from.passed * ratio[2];
        to.value = piece_.level + piece_.rate * end + to.fast + to.slow + to.passed + leaked(end);
        to.slope = piece_.rate - to.fast * piece_.k1 - to.slow * piece_.k2 - to.passed * piece_.k3 + leak_.rate;
      }
    }
    const NoiseCubic noise = noise_->cubic(path, i, state_.pole);
    // A cubic lies between the control points of its Bezier curve.
    const auto [lowest, highest] =
        std::minmax({noise.v0, noise.v1, noise.v0 + noise.s0 * length / 3, noise.v1 - noise.s1 * length / 3});
    const double outside = beyond_chord(from, to);
    if (std::min(from.value, to.value) - outside + gain_ * lowest <= lower() ||
        std::max(from.value, to.value) + outside + gain_ * highest >= upper()) {
      const double u = from.s - part_start, v = to.s - part_start;
      const NoiseCubic sum{from.value + gain_ * noise.value(u), from.slope + gain_ * noise.slope(u),
                           to.value + gain_ * noise.value(v), to.slope + gain_ * noise.slope(v), to.s - from.s};
      if (const auto exit = sum.first_exit(lower(), upper()))
        return CircuitCrossing{from.s + exit->first, exit->second};
    }
    from = to;
  }
  return std::nullopt;
}

const PhotoreceptorNoise::Path& CircuitPixel::path() const {
  if (known_.node != state_.node) {
    known_.path = noise_->path(state_.from, state_.to, pixel_, state_.node, state_.pole);
    known_.node = state_.node;
  }
  return known_.path;
}

/// Chooses the length of steps for the light at `s`.
void CircuitPixel::follow_light(double s) {
  state_.node_light = static_cast<float>(light(s));
  state_.pole = circuit_.pole(light(s));
}

/// Begins a step at a node, whose number is the next one.
void CircuitPixel::start_step(const NoiseState& from, double time) {
  state_.node += 1;
  state_.node_time = time;
  state_.from = from;
  state_.active = true;
  if (drawn_ != (state_.node & ~1U)) {
    drawn_ = state_.node & ~1U;
    noise_->draw(1, &pixel_, &drawn_, draws_);
  }
  const auto& n = draws_[state_.node - drawn_];
  const float drift = state_.node_light - static_cast<float>(light(time - start_));
  state_.to = noise_->after_step(from, {n[0][0], n[1][0]}, state_.pole, drift);
}

/// At the end of a step, where the signal is `value`: begins the next one, if the noise still matters.
void CircuitPixel::pass_node(const SignalAt& here) {
  const double time = state_.node_time + noise_->step_ns(state_.pole);
  if (std::abs(light(here.s) - static_cast<double>(state_.node_light)) > kLightReach) follow_light(here.s);
  const double distance = std::min(upper() - here.value, here.value - lower());
  if (distance < kInactiveDeviations * gain_ * noise_->deviation(state_.pole)) {
    start_step(state_.to, time);
    return;
  }
  state_.from = state_.to;
  state_.node += 1;
  state_.node_time = time;
  state_.active = false;
}

/// Begins with steps, somewhere between the last node and the next one.
void CircuitPixel::activate(double s) {
  follow_light(s);
  state_.node += 1;
  start_step(noise_->after_gap(state_.from, start_ + s - state_.node_time, pixel_, state_.node, state_.pole),
             start_ + s);
}

/// The noise at `s`, at the end of a reset. It continues from the last node before, whatever the signal did meanwhile.
double CircuitPixel::noise_at(double s) {
  if (state_.active) {
    const double end = state_.node_time + noise_->step_ns(state_.pole);
    if (end > start_ + s) return noise_->at(path(), start_ + s - state_.node_time, state_.pole);
    state_.from = state_.to;
    state_.node_time = end;
    state_.node += 1;
    state_.active = false;
  }
  follow_light(s);
  state_.node += 1;
  state_.from = noise_->after_gap(state_.from, start_ + s - state_.node_time, pixel_, state_.node, state_.pole);
  state_.node_time = start_ + s;
  return static_cast<double>(state_.from.x);
}

void CircuitPixel::open(double light, double signal, const LeakRamp& leak, double time, double place) {
  state_ = {};
  // The noise fires a pixel before it comes nearer to a threshold than its reach.
  const double reach = noise_ == nullptr ? 0.0 : kRestingDeviations * gain_ * circuit_.deviation(light);
  const double above = std::max(0.0, static_cast<double>(parameters_.on) - reach),
               below = std::max(0.0, static_cast<double>(parameters_.off) - reach);
  const double beyond = place * (above + below) - below;
  state_.reference = signal + leak.leaked - beyond;
  state_.node_time = time;
  state_.node_light = static_cast<float>(light);
  if (origin_ != nullptr) {
    // If the pixel leaks, the leak has brought it to its place; otherwise noise, or what it saw before.
    *origin_ = {signal, leak.rate != 0 ? leak.leaked - beyond : leak.leaked};
  }
  if (noise_ == nullptr) return;
  state_.pole = circuit_.pole(light);
  state_.from = noise_->first(pixel_, state_.pole);
  state_.reference += gain_ * static_cast<double>(state_.from.x);
}

/// Ends the reset of a pixel: its new reference is signal plus noise.
void CircuitPixel::release(const SignalAt& here) {
  state_.held_until = -1;
  if (origin_ != nullptr) origin_->v = piece_.value(here.s), origin_->leaked = leaked(here.s);
  const double value = here.value + (noise_ != nullptr ? gain_ * noise_at(here.s) : 0.0);
  const double change = value - state_.reference;
  lost_ +=
      static_cast<std::int64_t>(std::abs(change) / static_cast<double>(change > 0 ? parameters_.on : parameters_.off));
  state_.reference = value;
}

/// (15) of docs/methods/pixel.md. Noise is the rest of the threshold; without noise, the signal is.
void CircuitPixel::take_apart(double s, int polarity) {
  CircuitOrigin& o = *origin_;
  const double threshold = polarity > 0 ? static_cast<double>(parameters_.on) : -static_cast<double>(parameters_.off);
  const double v = piece_.value(s), all = leaked(s), leak = all - o.leaked;
  const double signal = noise_ != nullptr ? v - o.v : threshold - leak;
  o = {v, all, static_cast<float>(signal), static_cast<float>(threshold - leak - signal), static_cast<float>(leak)};
}

CircuitBounds CircuitPixel::bounds_without_noise() {
  const double light_now = light(piece_.length);
  state_.node_light = static_cast<float>(light_now);
  const double margin =
      noise_ == nullptr ? 0.0 : kActiveDeviations * gain_ * circuit_.deviation(light_now - kLightReach);
  return {margin - static_cast<double>(parameters_.off), static_cast<double>(parameters_.on) - margin, kNever};
}

}  // namespace esim::inline event_camera
