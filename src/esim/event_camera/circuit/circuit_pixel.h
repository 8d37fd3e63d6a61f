#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "esim/event_camera/circuit/photoreceptor_noise.h"
#include "esim/event_camera/circuit/photoreceptor_signal.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// What all pixels of a camera have in common.
struct Circuit {
  CircuitPoles poles;
  std::optional<PhotoreceptorNoise> noise{};
  bool waits = false;  ///< after an event, a pixel waits until it is acknowledged

  double t1_ns(double light) const { return poles.t1_unit_ns * std::exp(-light); }
  std::int16_t pole(double light) const {
    return static_cast<std::int16_t>(noise->pole_of(std::log(poles.t1_unit_ns) - light));
  }
  /// Standard deviation of the noise in steady light.
  double deviation(double light) const { return noise->deviation_at(t1_ns(light)); }
};

/// The fixed parameters of a pixel.
struct CircuitParameters {
  float on = 0, off = 0;  ///< thresholds, ln
  float noise = 1;        ///< factor on the noise
  float refractory = 0;   ///< ns
};

/// The state of a pixel's comparators and of its noise. Times are in ns after the camera's epoch.
struct CircuitPixelState {
  double reference = 0;
  double held_until = -1;  ///< end of its reset; infinity: until it is acknowledged
  double node_time = 0;    ///< start of the noise's interval
  NoiseState from, to;     ///< at the ends of the interval; if inactive, `from` is the state at node_time
  std::uint32_t node = 0;  ///< number of the node at the start of the interval
  float node_light = 0;    ///< L where the pole was chosen, or at the last bounds without noise
  std::int16_t pole = 0;
  std::int8_t level = 0;
  bool active = false;           ///< its noise matters at present
  std::uint8_t first_steps = 0;  ///< that remain since it became active
};

/// For labels: where the change of a pixel's signal begins, and its parts at the last event, ln.
struct CircuitOrigin {
  double v = 0;       ///< the comparators' input without leak and noise when the reference was set
  double leaked = 0;  ///< the leak then
  float signal = 0, noise = 0, leak = 0;
};

/// No event is possible while the signal minus the reference stays strictly within (low, high), the light within
/// kLightReach of node_light, and before the time `until`.
struct CircuitBounds {
  double low = 0, high = 0, until = 0;
};

inline constexpr double kLightReach = 0.2;  ///< change of L within which intervals of the noise keep their length
inline constexpr double kActiveDeviations =
    5.5;  ///< distance to a threshold, in deviations, at which noise begins to matter
inline constexpr double kInactiveDeviations = 6.0;  ///< distance at a node at which it ceases to matter

/// The leak on a stretch of time: leaked + rate s, s in ns after its start.
struct LeakRamp {
  double leaked = 0, rate = 0;  ///< ln; rate in 1/ns
};

/// Takes a pixel through a piece of its signal: its events, its refractory periods, its noise. The comparator's signal
/// is S(s) = piece.value(s) + leak, to which the noise is added.
class CircuitPixel {
 public:
  CircuitPixel(const Circuit& circuit, std::uint32_t pixel, const CircuitParameters& parameters,
               CircuitPixelState& state)
      : circuit_(circuit),
        noise_(circuit.noise ? &*circuit.noise : nullptr),
        pixel_(pixel),
        parameters_(parameters),
        state_(state),
        gain_(static_cast<double>(parameters.noise)) {}

  /// Sets the noise and the reference at the start, `time` after the epoch, as if the camera had been running before in
  /// this light. `signal` is the comparators' input; `place`, from 0 to 1, is where it then is between the two
  /// thresholds.
  void open(double light, double signal, const LeakRamp& leak, double time, double place);

  /// Keeps the parts of the change at events in `origin`.
  void explain(CircuitOrigin* origin) { origin_ = origin; }

  /// The stretch that the next functions are about: its signal, light and leak, and its start in ns after the epoch.
  void set(const CircuitPiece& piece, const LightRamp& light, const LeakRamp& leak, double start) {
    piece_ = piece, light_ = light, leak_ = leak, start_ = start, lost_ = 0;
  }

  /// Calls emit(time, polarity) for each event, and returns the bounds that hold afterwards.
  template <typename Emit>
  CircuitBounds run(const Emit& emit);

  /// Events that would have fired during resets since the last set().
  std::int64_t lost() const { return lost_; }

  /// Ends the reset of a pixel at `s`: its new reference is signal plus noise.
  void release(double s);

  double signal(double s) const { return piece_.value(s) + leaked(s); }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double upper() const { return state_.reference + static_cast<double>(parameters_.on); }
  double lower() const { return state_.reference - static_cast<double>(parameters_.off); }
  double light(double s) const { return light_.light + light_.rate * s; }
  double leaked(double s) const { return leak_.leaked + leak_.rate * s; }
  double reach(double s, double deviations) const {
    return noise_ == nullptr ? 0.0 : deviations * gain_ * circuit_.deviation(light(s));
  }
  std::pair<double, double> range(double a, double b) const {
    const auto [low, high] = piece_.range(a, b);
    return {low + std::min(leaked(a), leaked(b)), high + std::max(leaked(a), leaked(b))};
  }

  void take_apart(double s, int polarity);
  std::optional<double> find_near(double a, double b) const;
  /// Whether the slope of the signal has one sign on [a, b], by its ends and its maximum curvature.
  bool is_monotone(double a, double b) const {
    const double sa = piece_.slope(a) + leak_.rate, sb = piece_.slope(b) + leak_.rate;
    return sa * sb > 0 && std::min(std::abs(sa), std::abs(sb)) > 0.25 * std::abs(sa - sb);
  }
  void activate(double s);

  /// From ln to standard deviations of the noise.
  double per_deviation() const { return 1 / (gain_ * noise_->deviation(state_.pole)); }
  /// The drift of PhotoreceptorNoise for the light at `s`.
  double drift(double s) const {
    return (static_cast<double>(state_.node_light) - light(s)) * (1 / PhotoreceptorNoise::kDriftStep);
  }
  /// The level of the interval after a node with this signal; none if the pixel becomes inactive. A signal that has
  /// just come near a threshold will probably move on: its first intervals are steps.
  std::optional<std::int32_t> level_at(double value, double per_deviation) {
    const double distance = std::min(upper() - value, value - lower()) * per_deviation;
    if (distance >= kInactiveDeviations) return std::nullopt;
    if (state_.first_steps > 0) return --state_.first_steps, PhotoreceptorNoise::kSteps;
    return noise_->level_for(state_.pole, distance);
  }
  void follow_light(double s);
  void start_interval(const NoiseState& from, double s);
  std::optional<CircuitBounds> skip_quiet_steps(double& s);
  NoiseState noise_at(double s);
  CircuitBounds bounds_without_noise();

  /// S in units of the pixel's noise, by the time after the start of the noise's interval.
  struct Scaled {
    const CircuitPixel& pixel;
    double offset, scale;
    double value(double tau) const { return scale * pixel.signal(tau + offset); }
    double slope(double tau) const { return scale * (pixel.piece_.slope(tau + offset) + pixel.leak_.rate); }
    std::pair<double, double> range(double a, double b) const {
      const auto [low, high] = pixel.range(a + offset, b + offset);
      return {scale * low, scale * high};
    }
  };

  PhotoreceptorNoise::Interval interval() const {
    return {state_.from,
            state_.to,
            pixel_,
            state_.node,
            state_.pole,
            state_.level,
            noise_->length(state_.pole, state_.level)};
  }
  void set_interval(const PhotoreceptorNoise::Interval& interval) {
    state_.from = interval.from, state_.to = interval.to;
    state_.pole = static_cast<std::int16_t>(interval.pole), state_.level = static_cast<std::int8_t>(interval.level);
  }

  const Circuit& circuit_;
  const PhotoreceptorNoise* noise_;
  std::uint32_t pixel_;
  const CircuitParameters& parameters_;
  CircuitPixelState& state_;
  CircuitPiece piece_;
  LightRamp light_;
  LeakRamp leak_;
  double start_ = 0, gain_;
  CircuitOrigin* origin_ = nullptr;
  PhotoreceptorNoise::StepDraws draws_;
  std::int64_t lost_ = 0;
};

template <typename Emit>
CircuitBounds CircuitPixel::run(const Emit& emit) {
  const double length = piece_.length;
  const auto fire = [&](double s, int polarity) {
    if (origin_ != nullptr) take_apart(s, polarity);
    emit(start_ + s, polarity);
    state_.reference = polarity > 0 ? upper() : lower();
    if (circuit_.waits) {
      state_.held_until = kNever;
    } else if (parameters_.refractory > 0) {
      state_.held_until = start_ + s + static_cast<double>(parameters_.refractory);
    }
  };
  double s = 0;
  while (true) {
    if (state_.held_until > start_ + s) {
      if (state_.held_until > start_ + length) return {-kNever, kNever, state_.held_until};
      s = state_.held_until - start_;
      release(s);
    }
    if (noise_ == nullptr) {
      const auto crossing = find_near(s, length);
      if (!crossing) return bounds_without_noise();
      s = *crossing;
      fire(s, signal(s) >= upper() ? 1 : -1);
      continue;
    }
    if (!state_.active) {
      const auto near = find_near(s, length);
      if (!near) return bounds_without_noise();
      s = *near;
      activate(s);
    }
    if (state_.level == PhotoreceptorNoise::kSteps) {
      if (const auto bounds = skip_quiet_steps(s)) return *bounds;
      if (!state_.active) continue;
    }
    const PhotoreceptorNoise::Interval noise = interval();
    const double node = state_.node_time + noise.length - start_;
    double end = std::min(length, node);
    const double change = light(end) - static_cast<double>(state_.node_light);
    const bool recuts = std::abs(change) > kLightReach;
    if (recuts) {
      const double at = static_cast<double>(state_.node_light) + std::copysign(kLightReach, change) - light_.light;
      end = std::clamp(at / light_.rate, s, end);
    }
    const double offset = state_.node_time - start_;
    PhotoreceptorNoise::Quiet quiet;
    const auto crossing = noise_->first_crossing(noise, Scaled{*this, offset, 1 / gain_}, lower() / gain_,
                                                 upper() / gain_, s - offset, end - offset, quiet);
    if (crossing) {
      s = std::max(s, crossing->tau + offset);
      fire(s, crossing->polarity);
      continue;
    }
    s = end;
    if (recuts) {
      follow_light(s);
      start_interval(noise_->at(noise, s - offset), s);
    } else if (node <= length) {
      start_interval(noise.to, s);
    } else {
      return {gain_ * -quiet.low - static_cast<double>(parameters_.off),
              static_cast<double>(parameters_.on) - gain_ * quiet.high, state_.node_time + quiet.until};
    }
    if (s >= length && !state_.active) return bounds_without_noise();
  }
}

}  // namespace esim::inline event_camera
