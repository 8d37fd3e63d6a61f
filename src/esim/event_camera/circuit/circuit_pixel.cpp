#include "esim/event_camera/circuit/circuit_pixel.h"

namespace esim::inline event_camera {
namespace {

// Of the times at which a signal without noise crosses a level, and at which noise begins to matter.
constexpr double kResolution_ns = 0.25, kNoiseResolution_ns = 0.05;

constexpr double kRestingDeviations = 3.5;

}  // namespace

/// The first time in [a, b] at which the signal is so near to a threshold that the noise matters; without noise, at
/// which it reaches the threshold.
std::optional<double> CircuitPixel::find_near(double a, double b) const {
  // The reach of the noise falls with rising light, so that it is maximal at one of the ends.
  const double reach_max = reach(light_.rate > 0 ? a : b, kActiveDeviations);
  const auto [low, high] = range(a, b);
  if (high + reach_max < upper() && low - reach_max > lower()) return std::nullopt;
  const double reach_a = reach(a, kActiveDeviations), reach_b = reach(b, kActiveDeviations);
  const double value = signal(a);
  if (value + reach_a >= upper() || value - reach_a <= lower()) return a;
  if (b - a <= (noise_ == nullptr ? kResolution_ns : kNoiseResolution_ns)) {
    const double last = signal(b);
    return last + reach_b >= upper() || last - reach_b <= lower() ? std::optional(b) : std::nullopt;
  }
  const auto distance = [&](double s) {
    const double here = signal(s);
    return std::min(upper() - here, here - lower()) - reach(s, kActiveDeviations);
  };
  if (const double last = distance(b); last <= 0 && is_monotone(a, b)) {
    // The Illinois method, between a positive and a negative distance.
    double from = a, to = b, at_from = distance(a), at_to = last;
    const double resolution = noise_ == nullptr ? kResolution_ns : kNoiseResolution_ns;
    for (int i = 0, side = 0; i < 60 && to - from > resolution; ++i) {
      const double s = from + (to - from) * std::clamp(at_from / (at_from - at_to), 1e-3, 1 - 1e-3);
      const double here = distance(s);
      if (here <= 0) {
        to = s, at_to = here;
        if (side == 1) at_from *= 0.5;
        side = 1;
      } else {
        from = s, at_from = here;
        if (side == -1) at_to *= 0.5;
        side = -1;
      }
      if (here == 0) break;
    }
    return to;
  }
  const double middle = 0.5 * (a + b);
  if (const auto found = find_near(a, middle)) return found;
  return find_near(middle, b);
}

std::optional<std::pair<double, int>> CircuitPixel::find_crossing(const PhotoreceptorNoise::Part& part, double a,
                                                                  double b, double at_a, double at_b,
                                                                  PhotoreceptorNoise::Middles& middles) const {
  if (a >= b && part.index != 1) return std::nullopt;
  const auto [low, high] = noise_->bounds(state_.pole, part);
  const double beyond = piece_.beyond_chord(a, b);
  if (std::min(at_a, at_b) - beyond + gain_ * low > lower() && std::max(at_a, at_b) + beyond + gain_ * high < upper())
    return std::nullopt;
  const double start = state_.node_time - start_;
  if (noise_->is_cubic(state_.pole, part)) {
    const NoiseCubic noise = noise_->cubic(state_.pole, part);
    const double u = a - start - part.start, v = b - start - part.start;
    const NoiseCubic sum{at_a + gain_ * noise.value(u), slope(a) + gain_ * noise.slope(u),
                         at_b + gain_ * noise.value(v), slope(b) + gain_ * noise.slope(v), b - a};
    const auto exit = sum.first_exit(lower(), upper());
    return exit ? std::optional(std::pair{a + exit->first, exit->second}) : std::nullopt;
  }
  const auto [first, second] = noise_->halves(state_.pole, part, middles);
  const double middle = std::clamp(start + second.start, a, b);
  const double at_middle = middle == a ? at_a : middle == b ? at_b : signal(middle);
  if (const auto crossing = find_crossing(first, a, middle, at_a, at_middle, middles)) return crossing;
  return find_crossing(second, middle, b, at_middle, at_b, middles);
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
  if (drawn_ != (state_.node & ~3U)) {
    drawn_ = state_.node & ~3U;
    noise_->draw(1, &pixel_, &drawn_, draws_);
  }
  const auto& n = draws_[state_.node - drawn_];
  const double drift = (static_cast<double>(state_.node_light) - light(time - start_)) / PhotoreceptorNoise::kDriftStep;
  state_.to = noise_->after_step(from, {n[0][0], n[1][0]}, state_.pole, drift);
}

/// At the end of a step, where the signal is `value`: begins the next one, if the noise still matters.
void CircuitPixel::pass_node(double s, double value) {
  const double time = state_.node_time + noise_->step_ns(state_.pole);
  if (std::abs(light(s) - static_cast<double>(state_.node_light)) > kLightReach) follow_light(s);
  const double distance = std::min(upper() - value, value - lower());
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
    if (end > start_ + s) {
      PhotoreceptorNoise::Middles middles(pixel_, state_.node);
      return noise_->at(state_.pole, {state_.from, state_.to}, start_ + s - state_.node_time, middles);
    }
    state_.from = state_.to;
    state_.node_time = end;
    state_.node += 1;
    state_.active = false;
  }
  follow_light(s);
  state_.node += 1;
  state_.from = noise_->after_gap(state_.from, start_ + s - state_.node_time, pixel_, state_.node, state_.pole);
  state_.node_time = start_ + s;
  return state_.from.x;
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
  state_.reference += gain_ * state_.from.x;
}

void CircuitPixel::release(double s) {
  state_.held_until = -1;
  if (origin_ != nullptr) origin_->v = piece_.value(s), origin_->leaked = leaked(s);
  const double value = signal(s) + (noise_ != nullptr ? gain_ * noise_at(s) : 0.0);
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
