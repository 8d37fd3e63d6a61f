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
  double node_time = 0;    ///< of the noise's last node
  NoiseState from, to;     ///< the noise at the last node, and, if active, a step later
  std::uint32_t node = 0;  ///< number of the last node
  float node_light = 0;    ///< L where the pole was chosen, or at the last bounds without noise
  std::int16_t pole = 0;
  bool active = false;  ///< its noise matters at present
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

inline constexpr double kLightReach = 0.2;  ///< change of L within which steps of the noise keep their length
inline constexpr double kActiveDeviations =
    5.5;  ///< distance to a threshold, in deviations, at which noise begins to matter
inline constexpr double kInactiveDeviations = 6.0;  ///< distance at a node at which it ceases to matter

/// The leak on a stretch of time: leaked + rate s, s in ns after its start.
struct LeakRamp {
  double leaked = 0, rate = 0;  ///< ln; rate in 1/ns
};

/// Takes a pixel through a piece of its signal: its events, its refractory periods, its noise. The comparator's signal
/// is S(s) = piece.value(s) + leak, to which the noise is added. CircuitLanes does the same where nothing happens.
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

  /// Calls emit(time, polarity) for each event from `s` on, in ns after the start, and returns the bounds that hold
  /// afterwards.
  template <typename Emit>
  CircuitBounds run(const Emit& emit, double s = 0);

  /// Makes an inactive pixel active when a threshold comes near; returns this time, from `s` on, in ns after the start.
  std::optional<double> wake(double s) {
    const auto near = find_near(s, piece_.length);
    if (near) activate(*near);
    return near;
  }

  /// The first time in [a, b], within the step at the last node, at which signal plus noise reach a
  /// threshold, and the polarity. The signal is at_a and at_b at its ends.
  std::optional<std::pair<double, int>> find_crossing(double a, double b, double at_a, double at_b) const {
    PhotoreceptorNoise::Middles middles(pixel_, state_.node);
    return find_crossing({state_.from, state_.to}, a, b, at_a, at_b, middles);
  }

  /// The bounds of an inactive pixel at the end of its piece.
  CircuitBounds bounds_without_noise();

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
  double slope(double s) const { return piece_.slope(s) + leak_.rate; }
  double reach(double s, double deviations) const {
    return noise_ == nullptr ? 0.0 : deviations * gain_ * circuit_.deviation(light(s));
  }
  std::pair<double, double> range(double a, double b) const {
    const auto [low, high] = piece_.range(a, b);
    return {low + std::min(leaked(a), leaked(b)), high + std::max(leaked(a), leaked(b))};
  }

  std::optional<std::pair<double, int>> find_crossing(const PhotoreceptorNoise::Part& part, double a, double b,
                                                      double at_a, double at_b,
                                                      PhotoreceptorNoise::Middles& middles) const;
  void take_apart(double s, int polarity);
  std::optional<double> find_near(double a, double b) const;
  /// Whether the slope of the signal has one sign on [a, b], by its ends and its maximum curvature.
  bool is_monotone(double a, double b) const {
    const double sa = slope(a), sb = slope(b);
    return sa * sb > 0 && std::min(std::abs(sa), std::abs(sb)) > 0.25 * std::abs(sa - sb);
  }
  void activate(double s);
  void start_step(const NoiseState& from, double time);
  void pass_node(double s, double value);
  void follow_light(double s);
  double noise_at(double s);

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
  PhotoreceptorNoise::Draws draws_;
  std::uint32_t drawn_ = ~0U;  // the first node of draws_
  std::int64_t lost_ = 0;
};

template <typename Emit>
CircuitBounds CircuitPixel::run(const Emit& emit, double s) {
  const double length = piece_.length;
  const auto fire = [&](int polarity) {
    if (origin_ != nullptr) take_apart(s, polarity);
    emit(start_ + s, polarity);
    state_.reference = polarity > 0 ? upper() : lower();
    if (circuit_.waits) {
      state_.held_until = kNever;
    } else if (parameters_.refractory > 0) {
      state_.held_until = start_ + s + static_cast<double>(parameters_.refractory);
    }
  };
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
      fire(signal(s) >= upper() ? 1 : -1);
      continue;
    }
    if (!state_.active) {
      const auto near = wake(s);
      if (!near) return bounds_without_noise();
      s = *near;
    }
    const double node = state_.node_time - start_ + noise_->step_ns(state_.pole), end = std::min(length, node);
    const double next = signal(end);
    if (const auto crossing = find_crossing(s, end, signal(s), next)) {
      s = crossing->first;
      fire(crossing->second);
      continue;
    }
    s = end;
    if (node > length) {
      const auto [low, high] = noise_->bounds(state_.pole, {state_.from, state_.to});
      return {-gain_ * low - static_cast<double>(parameters_.off), static_cast<double>(parameters_.on) - gain_ * high,
              state_.node_time + noise_->step_ns(state_.pole)};
    }
    pass_node(s, next);
    if (s >= length && !state_.active) return bounds_without_noise();
  }
}

}  // namespace esim::inline event_camera
