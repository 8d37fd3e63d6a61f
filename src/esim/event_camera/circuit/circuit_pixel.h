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
  double log_t1_unit = std::log(poles.t1_unit_ns);

  std::int16_t pole(double light) const { return static_cast<std::int16_t>(noise->pole_of(log_t1_unit - light)); }
  /// Standard deviation of the noise in steady light.
  double deviation(double light) const { return noise->deviation_at(log_t1_unit - light).value; }
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

inline constexpr double kLightReach =
    PhotoreceptorNoise::kMaxDrift;  ///< change of L within which steps keep their length
inline constexpr double kActiveDeviations =
    5.5;  ///< distance to a threshold, in deviations, at which noise begins to matter
inline constexpr double kInactiveDeviations = 6.0;  ///< distance at a node at which it ceases to matter

/// The leak on a stretch of time: leaked + rate s, s in ns after its start.
struct LeakRamp {
  double leaked = 0, rate = 0;  ///< ln; rate in 1/ns
};

/// The signal at a time of a piece, and what remains of its exponentials.
struct SignalAt {
  double s = 0;  ///< ns after the start of the piece
  double value = 0, slope = 0;
  double fast = 0, slow = 0, passed = 0;  ///< those of CircuitPiece, decayed
};

/// An event: the signal plus noise reaches a threshold.
struct CircuitCrossing {
  double s = 0;  ///< ns after the start of the piece
  int polarity = 0;
};

/// The noise within a step, once it has been drawn.
struct KnownPath {
  std::uint32_t node = kNone;  ///< where the step begins
  PhotoreceptorNoise::Path path;

  static constexpr std::uint32_t kNone = ~0U;
};

/// Takes a pixel through a piece of its signal: its events, its refractory periods, its noise. The comparator's signal
/// is S(s) = piece.value(s) + leak, to which the noise is added. CircuitLanes does the same where nothing happens.
class CircuitPixel {
 public:
  /// `known` belongs to this pixel; it may be used for several objects.
  CircuitPixel(const Circuit& circuit, std::uint32_t pixel, const CircuitParameters& parameters,
               CircuitPixelState& state, KnownPath& known)
      : circuit_(circuit),
        noise_(circuit.noise ? &*circuit.noise : nullptr),
        pixel_(pixel),
        parameters_(parameters),
        state_(state),
        known_(known),
        gain_(static_cast<double>(parameters.noise)) {}

  /// The references for light that begins at a time in ns after the epoch, as if the camera had been running before in
  /// this light. `signal` is the comparators' input; `place`, from 0 to 1, is where it then is between the two
  /// thresholds.
  void open(double light, double signal, const LeakRamp& leak, double time, double place);

  /// Keeps the parts of the change at events in `origin`.
  void explain(CircuitOrigin* origin) { origin_ = origin; }

  /// The stretch that the next functions are about: its signal, light and leak, and its start in ns after the epoch.
  void set(const CircuitPiece& piece, const LightRamp& light, const LeakRamp& leak, double start) {
    piece_ = piece, light_ = light, leak_ = leak, start_ = start, lost_ = 0;
    terms_ = {piece.fast, piece.slow, piece.passed, 0}, decays_ = {-piece.k1, -piece.k2, -piece.k3, 0};
    has_end_ = false;
  }

  /// Calls emit(time, polarity) for each event from `s` on, in ns after the start, and returns the bounds that hold
  /// afterwards. `crossing`: the first event, if it is known.
  template <typename Emit>
  CircuitBounds run(const Emit& emit, double s = 0, std::optional<CircuitCrossing> crossing = {});

  /// Makes an inactive pixel active when a threshold comes near; returns this time, from `here` on, in ns after the
  /// start.
  std::optional<double> wake(const SignalAt& here) {
    const auto near = find_near(approach(here), approach(end()));
    if (near) activate(*near);
    return near;
  }

  /// The first event between a and b, within the step at the last node.
  std::optional<CircuitCrossing> find_crossing(double a, double b) const;

  /// The bounds of an inactive pixel at the end of its piece.
  CircuitBounds bounds_without_noise();

  /// Events that would have fired during resets since the last set().
  std::int64_t lost() const { return lost_; }

  SignalAt at(double s) const;

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  double upper() const { return state_.reference + static_cast<double>(parameters_.on); }
  double lower() const { return state_.reference - static_cast<double>(parameters_.off); }
  double light(double s) const { return light_.light + light_.rate * s; }
  double leaked(double s) const { return leak_.leaked + leak_.rate * s; }
  /// The signal at the end of the piece.
  const SignalAt& end() {
    if (!has_end_) end_ = at(piece_.length), has_end_ = true;
    return end_;
  }
  /// How far the signal leaves its chord between a and b, at most. As CircuitPiece::beyond_chord().
  double beyond_chord(const SignalAt& a, const SignalAt& b) const {
    const double e1 = std::abs(a.fast), e2 = std::abs(a.slow), e3 = std::abs(a.passed), span = b.s - a.s;
    const double curvature = e1 * piece_.k1 * piece_.k1 + e2 * piece_.k2 * piece_.k2 + e3 * piece_.k3 * piece_.k3;
    return std::min(0.125 * span * span * curvature, e1 + e2 + e3);
  }
  /// The signal, how far it is from the nearest threshold beyond the reach of the noise, and the slope of this
  /// distance.
  struct Approach {
    SignalAt signal;
    double distance, slope, reach;
  };
  Approach approach(const SignalAt& signal) const;
  std::optional<double> find_near(const Approach& a, const Approach& b) const;
  double solve_near(const Approach& a, const Approach& b) const;
  /// Of the times at which a signal without noise crosses a level, and at which noise begins to matter.
  double resolution_ns() const { return noise_ == nullptr ? 0.25 : 0.05; }
  /// Whether the slope of the signal has one sign between a and b, by its ends.
  static bool is_monotone(const SignalAt& a, const SignalAt& b) {
    return a.slope * b.slope > 0 && std::min(std::abs(a.slope), std::abs(b.slope)) > 0.25 * std::abs(a.slope - b.slope);
  }
  bool may_cross(const SignalAt& a, const SignalAt& b) const;
  std::uint32_t doubtful_parts(double a, double b) const;
  void take_apart(double s, int polarity);
  void release(const SignalAt& here);
  void activate(double s);
  std::array<float, 2> draws();
  void start_step(const NoiseState& from, double time);
  void pass_node(const SignalAt& here);
  void follow_light(double s);
  const PhotoreceptorNoise::Path& path() const;
  double noise_at(double s);

  const Circuit& circuit_;
  const PhotoreceptorNoise* noise_;
  std::uint32_t pixel_;
  const CircuitParameters& parameters_;
  CircuitPixelState& state_;
  KnownPath& known_;
  CircuitPiece piece_;
  alignas(32) std::array<double, 4> terms_{}, decays_{};  // of the exponentials of piece_
  LightRamp light_;
  LeakRamp leak_;
  double start_ = 0, gain_;
  bool has_end_ = false;
  SignalAt end_;
  CircuitOrigin* origin_ = nullptr;
  PhotoreceptorNoise::Draws draws_;
  std::uint32_t drawn_ = 0x80000000;  // the first node of draws_; above all nodes: none
  std::int64_t lost_ = 0;
};

template <typename Emit>
CircuitBounds CircuitPixel::run(const Emit& emit, double s, std::optional<CircuitCrossing> crossing) {
  const double length = piece_.length;
  const auto fire = [&](const CircuitCrossing& event) {
    if (origin_ != nullptr) take_apart(event.s, event.polarity);
    emit(start_ + event.s, event.polarity);
    state_.reference = event.polarity > 0 ? upper() : lower();
    if (circuit_.waits) {
      state_.held_until = kNever;
    } else if (parameters_.refractory > 0) {
      state_.held_until = start_ + event.s + static_cast<double>(parameters_.refractory);
    }
  };
  SignalAt here;
  const auto go_to = [&](double to) {
    here.s = to;
    if (state_.held_until <= start_ + to) here = at(to);
  };
  if (crossing) fire(*crossing), s = crossing->s;
  go_to(s);
  while (true) {
    if (state_.held_until > start_ + here.s) {
      if (state_.held_until > start_ + length) return {-kNever, kNever, state_.held_until};
      here = at(state_.held_until - start_);
      release(here);
    }
    if (noise_ == nullptr) {
      const auto near = find_near(approach(here), approach(end()));
      if (!near) return bounds_without_noise();
      here = at(*near);
      fire({*near, upper() - here.value < here.value - lower() ? 1 : -1});
      continue;
    }
    if (!state_.active) {
      const auto near = wake(here);
      if (!near) return bounds_without_noise();
      here = at(*near);
    }
    const double node = state_.node_time - start_ + noise_->step_ns(state_.pole);
    const SignalAt next = node < length ? at(node) : end();
    if (may_cross(here, next)) {
      if (crossing = find_crossing(here.s, next.s); crossing) {
        fire(*crossing);
        go_to(crossing->s);
        continue;
      }
    }
    if (node > length) {
      const auto [low, high] = noise_->bounds(state_.from, state_.to, state_.pole);
      return {-gain_ * low - static_cast<double>(parameters_.off), static_cast<double>(parameters_.on) - gain_ * high,
              state_.node_time + noise_->step_ns(state_.pole)};
    }
    here = next;
    pass_node(here);
    if (here.s >= length && !state_.active) return bounds_without_noise();
  }
}

}  // namespace esim::inline event_camera
