#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/fit/estimate.h"

namespace esim::inline fit {

/// Pixels with more events than this are hot, by the numbers of events of all pixels.
double hot_pixel_limit(std::vector<double> events);

/// Leak, noise and hot pixels of a sensor that saw a scene without motion, in constant light
/// (docs/methods/fitting.md, section 2).
///
/// With the thresholds' ratio r = C- / C+, a pixel with n ON and m OFF events in the time T leaks at (n - r m) / T: its
/// reference stays near its signal, whatever the noise. The leak rates of the pixels are log-normal. Hot pixels are
/// those far above.
class BackgroundFit {
 public:
  BackgroundFit(int width, int height) : pixels_(width, height) {}

  /// Events in order of time.
  void add(EventSpan events);

  struct Result {
    Estimate leak_rate, leak_decades, leak_jitter;  ///< leak_rate_hz, leak_mismatch_decades, leak_jitter
    Estimate hot_pixels, hot_rate, hot_decades;     ///< hot_pixels, hot_pixel_rate_hz, circuit.hot_mismatch_decades
    Estimate noise;                                 ///< shot_noise_hz: ON and OFF events besides those of the leak
    FittedDistribution leak;
    double on_hz = 0, off_hz = 0;  ///< mean of a pixel that is not hot
  };
  /// `duration_s`: of the recording. `ratio`: C- / C+.
  Result finish(double duration_s, double ratio) const;

 private:
  struct Pixel {
    std::array<std::uint32_t, 2> on{}, off{};  // in even and odd stretches of time
    TimeNs first = 0, last = 0;                // ON event
    double squares = 0;                        // of the intervals between ON events, s^2

    double count_on() const { return static_cast<double>(on[0]) + on[1]; }
    double count_off() const { return static_cast<double>(off[0]) + off[1]; }
  };
  struct Kept;  // the pixels that are not hot
  Kept separate_hot_pixels(double duration_s, Result& result) const;
  void fit_periodic(const Kept& kept, double duration_s, Result& result) const;
  void fit_moments(const Kept& kept, double duration_s, double ratio, Result& result) const;

  Image<Pixel> pixels_;
  std::optional<TimeNs> start_;
};

}  // namespace esim::inline fit
