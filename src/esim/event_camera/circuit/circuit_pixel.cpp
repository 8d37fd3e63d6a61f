#include "esim/event_camera/circuit/circuit_pixel.h"

namespace esim::inline event_camera {
namespace {

// Of the times at which a signal without noise crosses a level, and at which noise begins to matter.
constexpr double kResolution_ns = 0.25, kNoiseResolution_ns = 0.05;

constexpr double kRestingDeviations = 3.5;
constexpr std::uint8_t kFirstSteps = 16;

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

/// Chooses the lengths of intervals for the light at `s`.
void CircuitPixel::follow_light(double s) {
  state_.node_light = static_cast<float>(light(s));
  state_.pole = circuit_.pole(light(s));
}

void CircuitPixel::start_interval(const NoiseState& from, double s) {
  if (std::abs(light(s) - static_cast<double>(state_.node_light)) > kLightReach) follow_light(s);
  const auto level = level_at(signal(s), per_deviation());
  state_.node_time = start_ + s;
  state_.active = level.has_value();
  state_.node += 1;
  state_.from = from;
  if (level) set_interval(noise_->next(from, pixel_, state_.node, state_.pole, *level, drift(s), draws_));
}

/// Moves `s` through steps of the noise in which surely no threshold is reached: to the beginning of the first one that
/// may contain a crossing or is followed by an interval of another level, or to the end of the piece; then, returns
/// bounds.
std::optional<CircuitBounds> CircuitPixel::skip_quiet_steps(double& s) {
  const double scale = per_deviation();
  const double h = noise_->length(state_.pole, PhotoreceptorNoise::kSteps);
  const double decay1 = std::exp(-piece_.k1 * h), decay2 = std::exp(-piece_.k2 * h);
  const double curve1 = 0.125 * piece_.k1 * piece_.k1, curve2 = 0.125 * piece_.k2 * piece_.k2;
  const double curve3 = 0.125 * piece_.k3 * piece_.k3;
  const auto passed_at = [&](double at) { return piece_.k3 == 0 ? 0.0 : piece_.passed * std::exp(-piece_.k3 * at); };
  double fast = piece_.fast * std::exp(-piece_.k1 * s), slow = piece_.slow * std::exp(-piece_.k2 * s);
  double passed = passed_at(s);
  double value = piece_.level + piece_.rate * s + fast + slow + passed + leaked(s);
  for (bool at_node = false;; at_node = true) {
    const double node = state_.node_time + h, end = std::min(node - start_, piece_.length), length = end - s;
    const auto [low, high] = noise_->step_bounds(state_.from, state_.to, h);
    const double curvature = std::abs(fast) * curve1 + std::abs(slow) * curve2 + std::abs(passed) * curve3;
    const double beyond = std::min(curvature * length * length, std::abs(fast) + std::abs(slow) + std::abs(passed));
    const bool whole = at_node && node - start_ <= piece_.length;
    fast *= whole ? decay1 : std::exp(-piece_.k1 * length), slow *= whole ? decay2 : std::exp(-piece_.k2 * length);
    passed = passed_at(end);
    const double next = piece_.level + piece_.rate * end + fast + slow + passed + leaked(end);
    const double change = std::abs(light(end) - static_cast<double>(state_.node_light));
    if (std::min(value, next) - beyond + gain_ * low <= lower() ||
        std::max(value, next) + beyond + gain_ * high >= upper() || change > kLightReach)
      return std::nullopt;
    if (node - start_ > piece_.length)
      return CircuitBounds{-gain_ * low - static_cast<double>(parameters_.off),
                           static_cast<double>(parameters_.on) - gain_ * high, node};
    if (level_at(next, scale) != PhotoreceptorNoise::kSteps) return std::nullopt;
    state_.from = state_.to;
    state_.node += 1;
    state_.to = noise_->after_step(state_.from, pixel_, state_.node, state_.pole, drift(end), draws_);
    state_.node_time = node;
    s = end, value = next;
  }
}

void CircuitPixel::activate(double s) {
  follow_light(s);
  state_.first_steps = kFirstSteps;
  state_.node += 1;
  const NoiseState from = noise_->after(state_.from, start_ + s - state_.node_time, pixel_, state_.node, state_.pole);
  start_interval(from, s);
  if (state_.active) return;
  state_.active = true;  // between the distances at which it becomes inactive and active
  set_interval(noise_->next(from, pixel_, state_.node, state_.pole, 0, 0, draws_));
}

/// The noise at `s`, at the end of a reset. It continues from the last node before, whatever the signal did meanwhile.
NoiseState CircuitPixel::noise_at(double s) {
  if (state_.active) {
    const PhotoreceptorNoise::Interval last = interval();
    if (state_.node_time + last.length > start_ + s) return noise_->at(last, start_ + s - state_.node_time);
    state_.from = last.to;
    state_.node_time += last.length;
    state_.node += 1;
    state_.active = false;
  }
  state_.node += 1;
  follow_light(s);
  state_.from = noise_->after(state_.from, start_ + s - state_.node_time, pixel_, state_.node, state_.pole);
  state_.node_time = start_ + s;
  return state_.from;
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
  state_.active = true;
  state_.node = 1;
  set_interval(noise_->first(pixel_, circuit_.pole(light), PhotoreceptorNoise::kSteps, draws_));
  state_.reference += gain_ * state_.from.x;
}

void CircuitPixel::release(double s) {
  state_.held_until = -1;
  if (origin_ != nullptr) origin_->v = piece_.value(s), origin_->leaked = leaked(s);
  const double value = signal(s) + (noise_ != nullptr ? gain_ * noise_at(s).x : 0.0);
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
