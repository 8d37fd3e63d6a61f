// Accelerates (9), next_shot() and find_shot() in reference.cpp, for a block of pixels.
#pragma once

#include <algorithm>
#include <cmath>

#include "esim/event_camera/effects/effect.h"
#include "esim/event_camera/options.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// A Poisson process at its maximum rate, thinned according to the current irradiance.
struct ShotNoise : PixelEffect {
  struct State {
    double shot_at = kNeverNs;  // next candidate
    std::uint32_t shots = 0;    // number of candidates
  };
  struct Lanes {
    PerPixel<double> shot_at{};
    PerPixel<std::uint32_t> shots{};
  };

  ShotNoise(const EventCameraOptions& o, std::uint64_t seed, std::uint16_t stream)
      : options_(o), random_(seed, Purpose::shot_noise, stream) {
    active = timer = o.shot_noise_hz > 0;
  }

  static void take(Lanes& lanes, std::size_t i, const State& state, double epoch_ns) {
    lanes.shot_at[i] = state.shot_at - epoch_ns, lanes.shots[i] = state.shots;
  }
  static void store(const Lanes& lanes, std::size_t i, State& state, double epoch_ns) {
    state.shot_at = epoch_ns + lanes.shot_at[i], state.shots = lanes.shots[i];
  }
  static void keep(Lanes& lanes, std::size_t i, std::size_t to) {
    lanes.shot_at[to] = lanes.shot_at[i], lanes.shots[to] = lanes.shots[i];
  }

  void open(Lanes& lanes, const Round& round) const {
    const PerPixel<double> uniform = draw_uniforms(random_, *round.active, 0);
    for (std::size_t i = 0; i < round.compare.count; ++i) {
      const bool dead = std::isinf(round.compare.on[i]);
      lanes.shot_at[i] = dead ? kNeverNs : interval(uniform[i]);
      lanes.shots[i] = 1;
    }
  }

  void find(Lanes& lanes, Round& round) const {
    for (std::size_t i = 0; i < round.compare.count; ++i) {
      if (lanes.shot_at[i] <= round.duration) [[unlikely]]
        find_one(lanes, round, i);
    }
  }

  static double next(const Lanes& lanes, std::size_t i) { return lanes.shot_at[i]; }

  /// Back to the first candidate after `until`.
  void take_back(State& state, std::uint32_t pixel, double until) const {
    while (state.shots > 1) {
      const auto bits = random_.bits(pixel, state.shots - 1);
      const double before = state.shot_at - interval((bits[0] + 0.5) * kToUnit);
      if (before < until) break;
      state.shot_at = before;
      --state.shots;
    }
  }

 private:
  static constexpr double kToUnit = 0x1.0p-32;  // from a random word to [0, 1)

  /// Time from one candidate to the next, ns.
  double interval(double uniform) const {
    return std::floor(std::min(-std::log(uniform) / options_.shot_noise_hz * 1e9, kNeverNs)) + 1;
  }

  /// The first accepted candidate before the crossing becomes the pixel's event.
  void find_one(Lanes& lanes, Round& round, std::size_t i) const {
    const ActivePixels& pixels = *round.active;
    Comparators& c = round.compare;
    double& at = lanes.shot_at[i];
    const double dark = options_.dark_irradiance;
    while (at <= round.duration && !(c.polarity[i] != 0 && at >= c.tau[i])) {
      const double tau = at;
      const auto bits = random_.bits(pixels.pixel[i], lanes.shots[i]++);
      at += interval((bits[0] + 0.5) * kToUnit);
      if (tau <= 0 || tau < c.from[i]) continue;  // within a refractory period
      const double light = pixels.light0[i] + (pixels.light1[i] - pixels.light0[i]) * tau / round.duration;
      const double intensity = std::min((light + dark) / (1.0 + dark), 1.0);
      const double accepted = 1.0 - (1.0 - options_.shot_noise_at_white) * intensity;
      if (bits[1] * kToUnit >= accepted) continue;
      c.tau[i] = tau;
      c.polarity[i] = (bits[2] & 1U) != 0 ? 1.0 : -1.0;
      round.restarts[i] = 1;
      round.own[i] = 1;
      return;
    }
  }

  EventCameraOptions options_;
  AddressedRandom random_;
};

}  // namespace esim::inline event_camera
