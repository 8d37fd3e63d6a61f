// Accelerates the noise of (7) in draw_parameters() of reference.cpp, for a block of pixels.
#pragma once

#include "esim/event_camera/effects/effect.h"
#include "esim/event_camera/options.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Thresholds that are new for each event.
struct ThresholdNoise : PixelEffect {
  struct State {
    float mean_on = 0, mean_off = 0;  // with mismatch, relative to the camera's
  };
  struct Lanes {
    PerPixel<float> mean_on{}, mean_off{};
  };

  ThresholdNoise(const EventCameraOptions& o, std::uint64_t, std::uint16_t)
      : sigma_(o.threshold_noise),
        min_on_(kMinContrastThreshold - o.threshold_on()),
        min_off_(kMinContrastThreshold - o.threshold_off()) {
    active = draws = sigma_ > 0;
  }

  static void make(State& state, const PixelParameters& pixel) { state.mean_on = pixel.on, state.mean_off = pixel.off; }
  static void take(Lanes& lanes, std::size_t i, const State& state, double) {
    lanes.mean_on[i] = state.mean_on, lanes.mean_off[i] = state.mean_off;
  }
  static void keep(Lanes& lanes, std::size_t i, std::size_t to) {
    lanes.mean_on[to] = lanes.mean_on[i], lanes.mean_off[to] = lanes.mean_off[i];
  }

  void renew(const Lanes& lanes, Round& round) const {
    Comparators& c = round.compare;
    const double sigma = sigma_, min_on = min_on_, min_off = min_off_;
    const auto &normal_on = round.normals[0], &normal_off = round.normals[1];
#pragma omp simd
    for (std::size_t i = 0; i < c.count; ++i) {
      const bool fired = c.polarity[i] != 0;
      const double on = lanes.mean_on[i] + sigma * normal_on[i], off = lanes.mean_off[i] + sigma * normal_off[i];
      c.on[i] = fired ? static_cast<float>(on > min_on ? on : min_on) : c.on[i];
      c.off[i] = fired ? static_cast<float>(off > min_off ? off : min_off) : c.off[i];
    }
  }

 private:
  double sigma_, min_on_, min_off_;
};

}  // namespace esim::inline event_camera
