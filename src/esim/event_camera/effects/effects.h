// The options that reference.cpp tests for each event, (5) and (7) to (14), tested once per camera.
#pragma once

#include <cstdint>

#include "esim/core/time.h"
#include "esim/event_camera/effects/latency.h"
#include "esim/event_camera/effects/leak.h"
#include "esim/event_camera/effects/shot_noise.h"
#include "esim/event_camera/effects/threshold_noise.h"

// The effects of a camera's pixels.
// Private to event_camera.
namespace esim::inline event_camera {

/// Several effects, with their options, in the order in which they are applied.
template <class... E>
struct EffectList : E... {
  struct States : E::State... {};
  struct Lanes : E::Lanes... {};

  EffectList(const EventCameraOptions& options, std::uint64_t seed, std::uint16_t stream)
      : E(options, seed, stream)... {}

  /// Calls use(effect) for each effect, or only for the active ones.
  template <class F>
  void each(const F& use) const {
    (use(static_cast<const E&>(*this)), ...);
  }
  template <class F>
  void each_active(const F& use) const {
    each([&](const auto& effect) {
      if (effect.active) use(effect);
    });
  }
  bool any(bool PixelEffect::*need) const {
    bool found = false;
    each([&](const PixelEffect& effect) { found |= effect.*need; });
    return found;
  }

  /// The time of the next event that an effect causes.
  double next(const Lanes& lanes, std::size_t i) const {
    double time = kNeverNs;
    each([&](const auto& effect) {
      const double of_effect = effect.next(lanes, i);
      time = of_effect < time ? of_effect : time;
    });
    return time;
  }
};

/// The list of effects after the low-pass: add a new one here.
using PixelEffects = EffectList<ThresholdNoise, Leak, ShotNoise, Latency>;

/// Which effects of the options are active, and the state of each pixel that they need. Computed once for a camera.
struct ActiveEffects : PixelEffects {
  ActiveEffects(const EventCameraOptions& o, std::uint64_t seed, std::uint16_t stream)
      : PixelEffects(o, seed, stream),
        poles(o.low_pass_hz > 0 ? o.low_pass_order : 0),
        in_brightness(poles > 0 || o.response != PixelResponse::log || o.surround_px > 0),
        acknowledged(o.readout.limited()),
        holds((refractory(o) > 0 || acknowledged) && o.refractory_mode == RefractoryMode::hold),
        drops(refractory(o) > 0 && !acknowledged && !holds),
        timers(any(&PixelEffect::timer)),
        draws(any(&PixelEffect::draws)),
        clean(!in_brightness && !drops && !any(&PixelEffect::active)) {}

  static TimeNs refractory(const EventCameraOptions& o) { return to_ns(o.refractory_period_us * 1e-6); }

  // Low-pass, response and surround. State: the brightness at the last sample, and the output of each pole.
  int poles;           ///< of the low-pass
  bool in_brightness;  ///< bounds are of the filtered brightness, not of the irradiance

  // Refractory period and readout. State: the end of the last refractory period.
  bool acknowledged;  ///< a readout acknowledges events: refractory periods begin when an event has been read out
  bool holds;         ///< pixels are held in reset from their event to the end of the refractory period
  bool drops;         ///< events that fall into a refractory period are lost

  // What PixelEffects need together. State: that of each of them.
  bool timers;  ///< a timer for each pixel
  bool draws;   ///< four normal deviates for each event; state: the number of draws
  bool clean;   ///< no PixelEffects, and bounds of irradiance: CleanPass is enough; state: CleanPixel
};

}  // namespace esim::inline event_camera
