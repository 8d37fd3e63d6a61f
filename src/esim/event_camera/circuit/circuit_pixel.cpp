#include "esim/event_camera/circuit/circuit_pixel.h"

namespace esim::inline event_camera {
namespace {

constexpr double kResolution_ns = 0.25;  // of the times at which a signal without noise crosses a level

}  // namespace

/// The first time in [a, b] at which the signal is so near to a threshold that the noise matters; without noise, at
/// which it reaches the threshold.
std::optional<double> CircuitPixel::find_near(double a, double b) const {
  // The reach of the noise falls with rising light, so that it is greatest at one of the ends.
  const double reach_a = reach(a, kWakeDeviations), reach_b = reach(b, kWakeDeviations);
  const double value = signal(a);
  if (value + reach_a >= upper() || value - reach_a <= lower()) return a;
  const auto [low, high] = range(a, b);
  const double reach = std::max(reach_a, reach_b);
  if (high + reach < upper() && low - reach > lower()) return std::nullopt;
  if (b - a <= kResolution_ns) {
    const double last = signal(b);
    return last + reach_b >= upper() || last - reach_b <= lower() ? std::optional(b) : std::nullopt;
  }
  const double middle = 0.5 * (a + b);
  if (const auto found = find_near(a, middle)) return found;
  return find_near(middle, b);
}

void CircuitPixel::start_interval(const NoiseState& from, double s) {
  const double here = light(s), value = signal(s);
  const double distance = std::min(upper() - value, value - lower()) / (gain_ * circuit_.deviation(here));
  state_.node_time = start_ + s;
  state_.node_light = static_cast<float>(here);
  state_.active = distance < kSleepDeviations;
  state_.node += 1;
  state_.from = from;
  if (!state_.active) return;
  set_interval(noise_->next(from, pixel_, state_.node, noise_->pole_of(circuit_.t1_ns(here)),
                            PhotoreceptorNoise::level_for(distance)));
}

void CircuitPixel::activate(double s) {
  const double here = light(s);
  const std::int32_t pole = noise_->pole_of(circuit_.t1_ns(here));
  state_.node += 1;
  const NoiseState from = noise_->after(state_.from, start_ + s - state_.node_time, pixel_, state_.node, pole);
  start_interval(from, s);
  if (state_.active) return;
  state_.active = true;  // between the distances at which it falls asleep and wakes up
  set_interval(noise_->next(from, pixel_, state_.node, pole, 0));
}

/// The noise at `s`, which is after all that has been searched.
NoiseState CircuitPixel::noise_at(double s) {
  while (state_.active) {
    const PhotoreceptorNoise::Interval now = interval();
    const double end = state_.node_time + now.length - start_;
    if (end > s) return noise_->at(now, start_ + s - state_.node_time);
    start_interval(now.to, end);
  }
  state_.node += 1;
  state_.from = noise_->after(state_.from, start_ + s - state_.node_time, pixel_, state_.node,
                              noise_->pole_of(circuit_.t1_ns(light(s))));
  state_.node_time = start_ + s;
  state_.node_light = static_cast<float>(light(s));
  return state_.from;
}

void CircuitPixel::open(double light, double time) {
  state_ = {};
  state_.reference = light + leak_ * time;
  state_.node_time = time;
  state_.node_light = static_cast<float>(light);
  if (noise_ == nullptr) return;
  state_.active = true;
  state_.node = 1;
  set_interval(noise_->first(pixel_, noise_->pole_of(circuit_.t1_ns(light)), PhotoreceptorNoise::kLevels - 1));
  state_.reference += gain_ * state_.from.x;
}

void CircuitPixel::release(double s) {
  state_.held_until = -1;
  state_.reference = signal(s) + (noise_ != nullptr ? gain_ * noise_at(s).x : 0.0);
}

CircuitBounds CircuitPixel::bounds_without_noise() {
  const double light_now = light(piece_.length);
  state_.node_light = static_cast<float>(light_now);
  const double margin =
      noise_ == nullptr ? 0.0 : kWakeDeviations * gain_ * circuit_.deviation(light_now - kLightReach);
  return {margin - static_cast<double>(parameters_.off), static_cast<double>(parameters_.on) - margin, kNever};
}

}  // namespace esim::inline event_camera
