// Accelerates (12), delay() in reference.cpp, for a block of pixels.
#pragma once

#include <cmath>

#include "esim/event_camera/effects/effect.h"
#include "esim/event_camera/options.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Time stamps that are later than the crossings.
struct Latency : PixelEffect {
  struct State {};
  struct Lanes {};

  Latency(const EventCameraOptions& o, std::uint64_t, std::uint16_t)
      : mean_(o.latency_us * 1e3),
        jitter_(o.latency_jitter_us * 1e3),
        light_fraction_(o.latency_light_share),
        dark_(o.dark_irradiance) {
    active = mean_ > 0 || jitter_ > 0;
    draws = jitter_ > 0;
  }

  void delay(const Lanes&, Round& round) const {
    const ActivePixels& pixels = *round.active;
    const Comparators& c = round.compare;
    const double mean = mean_, jitter = jitter_, fraction = light_fraction_, dark = dark_, longest = round.max_delay;
    const double per_duration = 1 / round.duration;
    const PerPixel<float>& normal = round.normals[3];
#pragma omp simd
    for (std::size_t i = 0; i < c.count; ++i) {
      const double light = pixels.light0[i] + (pixels.light1[i] - pixels.light0[i]) * c.tau[i] * per_duration;
      const double slower = 1.0 - fraction + fraction * (1.0 + dark) / (light + dark);
      double ns = (mean + (jitter > 0 ? jitter * normal[i] : 0.0)) * (fraction > 0 ? slower : 1.0);
      ns = ns > 0 ? ns : 0.0;
      ns = ns < longest ? ns : longest;
      round.stamp[i] += std::floor(ns + 0.5);
    }
  }

 private:
  double mean_, jitter_, light_fraction_, dark_;  // ns, ns, fraction, irradiance
};

}  // namespace esim::inline event_camera
