// The state of struct Pixel in reference.cpp, for a block of pixels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "esim/core/per_pixel.h"

// Blocks of pixels that advance through a segment.
// Private to event_camera.
namespace esim::inline event_camera {

/// Effectively never, ns: three years.
inline constexpr double kNeverNs = 1e17;

/// The active pixels of a segment. Unused values of the low-pass are arbitrary.
struct ActivePixels {
  PerPixel<std::uint32_t> pixel, place;  ///< index; EventPacking::place()
  PerPixel<float> light0, light1;        ///< irradiance at the segment's ends
  PerPixel<float> start, end;            ///< brightness there
  PerPixel<float> filtered1, filtered2;  ///< after each pole, at the segment's start
  PerPixel<float> phase, moved;          ///< duration of the segment in time constants, and 1 - exp(-phase)
  std::size_t count = 0;

  void copy(std::size_t i, std::size_t to) {
    pixel[to] = pixel[i], place[to] = place[i];
    for (auto* values : {&light0, &light1, &start, &end, &filtered1, &filtered2, &phase, &moved})
      (*values)[to] = (*values)[i];
  }
};

/// The comparators of a block: levels and results. Times are in ns after the segment's start. The signal is G minus the
/// drift until the segment's start: F(tau) + drift tau, where F is the brightness after the low-pass.
struct Comparators {
  double threshold_on = 0, threshold_off = 0;
  PerPixel<float> on, off;  ///< the pixel's thresholds relative to these two
  PerPixel<double> reference;
  PerPixel<double> drift;     ///< contribution of the effects to the signal, 1/ns
  PerPixel<double> from;      ///< start of the search
  PerPixel<double> tau;       ///< first time at which the signal leaves the levels
  PerPixel<double> polarity;  ///< crossed level: 1 upper, -1 lower, 0 none
  std::size_t count = 0;

  double upper(std::size_t i) const { return reference[i] + (threshold_on + static_cast<double>(on[i])); }
  double lower(std::size_t i) const { return reference[i] - (threshold_off + static_cast<double>(off[i])); }

  void copy(std::size_t i, std::size_t to) {
    on[to] = on[i], off[to] = off[i], reference[to] = reference[i], drift[to] = drift[i], from[to] = from[i];
  }
};

}  // namespace esim::inline event_camera
