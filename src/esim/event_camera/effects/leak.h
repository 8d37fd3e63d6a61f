// Accelerates (8), with hot pixels (10): open() and draw_parameters() in reference.cpp, for a block of pixels.
#pragma once

#include <cmath>

#include "esim/event_camera/effects/effect.h"
#include "esim/event_camera/options.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// References that fall: the comparators' drift.
struct Leak : PixelEffect {
  struct State {
    float mean_leak = 0;  // 1/s
  };
  struct Lanes {
    PerPixel<float> mean_leak{};
  };

  Leak(const EventCameraOptions& o, std::uint64_t seed, std::uint16_t stream)
      : options_(o), random_(seed, Purpose::leak_mismatch, stream), defects_(seed, Purpose::pixel_defects, stream) {
    active = timer = o.leak_rate_hz > 0 || (o.hot_pixels > 0 && o.hot_pixel_rate_hz > 0);
    draws = active && o.leak_jitter > 0;
  }

  void make(State& state, PixelParameters& pixel) const {
    if (!active || pixel.dead) return;
    const bool hot = options_.hot_pixels > 0 && defects_.uniforms(pixel.pixel)[0] < options_.hot_pixels;
    const double rate = hot ? options_.hot_pixel_rate_hz : options_.leak_rate_hz,
                 decades = options_.leak_mismatch_decades;
    const double spread = decades > 0 ? std::pow(10.0, decades * random_.normals(pixel.pixel)[0]) : 1;
    state.mean_leak = static_cast<float>(rate * spread * (pixel.threshold_on + pixel.on));
    pixel.drift = state.mean_leak;
  }
  static void take(Lanes& lanes, std::size_t i, const State& state, double) { lanes.mean_leak[i] = state.mean_leak; }
  static void keep(Lanes& lanes, std::size_t i, std::size_t to) { lanes.mean_leak[to] = lanes.mean_leak[i]; }

  /// A sensor that leaks is already running at the start: it is at a random time between two leak events.
  void open(const Lanes&, Round& round) const {
    Comparators& c = round.compare;
    const PerPixel<double> phase = draw_uniforms(random_, *round.active, 1);
    for (std::size_t i = 0; i < c.count; ++i) {
      const double threshold = c.threshold_on + c.on[i];
      if (c.drift[i] > 0) c.reference[i] -= threshold * phase[i];
    }
  }

  void renew(const Lanes& lanes, Round& round) const {
    if (!draws) return;
    Comparators& c = round.compare;
    const double jitter = options_.leak_jitter;
    const auto& normal = round.normals[2];
#pragma omp simd
    for (std::size_t i = 0; i < c.count; ++i) {
      const double interval = 1.0 + jitter * normal[i];
      const auto rate = static_cast<float>(lanes.mean_leak[i] / (interval > kMinInterval ? interval : kMinInterval));
      const double leak = c.polarity[i] != 0 ? rate * kPerNs : c.drift[i];
      // The new leak starts at this event, so that the signal is continuous.
      round.passed[i] += (leak - c.drift[i]) * c.tau[i];
      c.drift[i] = leak;
    }
  }

 private:
  static constexpr double kMinInterval = 0.05;  // between two leak events, as a fraction of the mean
  static constexpr double kPerNs = 1e-9;

  EventCameraOptions options_;
  AddressedRandom random_, defects_;
};

}  // namespace esim::inline event_camera
