#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/sensors/event_camera_options.h"

namespace esim {

/// Before every time, but so that differences do not overflow.
inline constexpr TimeNs kLongAgo = std::numeric_limits<TimeNs>::min() / 2;

/// After every time, likewise.
inline constexpr TimeNs kFarAhead = std::numeric_limits<TimeNs>::max() / 2;

/// As good as never, in ns: three years.
inline constexpr double kAges = 1e17;

/// In place of the reference of a pixel that is held in reset.
inline constexpr double kHeld = std::numeric_limits<double>::infinity();

/// What the pixels of a camera remember, and what makes them differ. Private to the event camera.
///
/// A pixel compares G, its brightness behind the low-pass plus what has leaked since the epoch, with its reference. It
/// sleeps as long as its signal stays in a band around the reference that it cannot leave without an event, and its
/// alarm has not gone off: most pixels of most segments are settled by these comparisons.
class PixelArray {
 public:
  PixelArray(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);

  /// Sets where leaks and alarms count from, if it is not set.
  void set_epoch(TimeNs t) {
    if (epoch == kLongAgo) epoch = t;
  }

  /// Gives pixels the bands between these levels. The arrays have kVectorPadding elements more, and are overwritten.
  void set_bands(std::size_t count, const std::uint32_t* which, float* low, float* high);

  /// Holds a pixel in reset until then, whatever it did before.
  void hold(std::uint32_t pixel, TimeNs until);
  /// Takes a pixel back to where it was when it had fired `events` events less. It must be held afterwards, until
  /// `until`: its reference is lost.
  void take_back(std::uint32_t pixel, std::uint32_t events, TimeNs until);

  /// Asks memory for what is needed of a pixel that wakes up.
  void prefetch(std::size_t pixel) const {
    if (clean) {
      __builtin_prefetch(&clean_pixels[pixel], 1);
    } else {
      __builtin_prefetch(&noisy_pixels[pixel], 1);
    }
  }

  void empty_band(std::uint32_t pixel) {
    band_low[pixel] = std::numeric_limits<float>::infinity();
    band_high[pixel] = -std::numeric_limits<float>::infinity();
  }

  /// Time from one candidate of shot noise to the next, ns.
  double shot_interval(double uniform) const;

  double relative_intensity(double irradiance) const {
    return (irradiance + options.dark_irradiance) / (1.0 + options.dark_irradiance);
  }
  double seconds_since_epoch(TimeNs t) const { return to_seconds(t - epoch); }
  std::int32_t ticks(TimeNs t) const { return ticks_after_epoch(static_cast<double>(t - epoch)); }
  static std::int32_t ticks_after_epoch(double ns) {
    const double ticks = ns * kTicksPerNs;
    return static_cast<std::int32_t>(ticks < kLastTick ? ticks : kLastTick);  // times are after the epoch
  }

  EventCameraOptions options;
  int width, height;
  double threshold_on, threshold_off;
  TimeNs refractory;
  bool acknowledged;        // by a readout: refractory periods begin when an event has been read out
  bool holds;               // pixels are held in reset from their event to the end of the refractory period
  bool drops;               // events that fall into a refractory period are lost
  TimeNs epoch = kLongAgo;  // of leaks and alarms: the first sample

  // Which parts of the model are in use.
  bool in_brightness;  // the band is one of brightness, not of irradiance
  bool leaks, shoots;  // pixels fire without a change of light
  bool alarmed;        // either
  bool renews;         // thresholds, leaks or latencies differ from event to event
  bool delays;         // time stamps come later than crossings
  bool clean;          // nothing but the light makes pixels fire, and bands are of irradiance

  // What is needed of a pixel that wakes up, in one place each. Thresholds count from the camera's.

  struct CleanPixel {
    double reference = 0;   // G at the last event; kHeld while the pixel is held in reset
    float on = 0, off = 0;  // what the pixel's thresholds are above threshold_on and threshold_off
  };
  LargeVector<CleanPixel> clean_pixels;
  LargeVector<TimeNs> until;  // of clean pixels that are held in reset

  struct alignas(64) NoisyPixel {
    double reference = 0;
    float on = 0, off = 0, mean_on = 0, mean_off = 0;
    float leak = 0, mean_leak = 0;  // 1/s, in brightness
    std::uint32_t draws = 0;        // for its events, so far
    std::uint32_t shots = 0;        // candidates of shot noise, so far
    double shot_at = 0;             // the next of them, ns after the epoch
    double until = -kAges;          // end of the last refractory period, likewise
  };
  LargeVector<NoisyPixel> noisy_pixels;

  // Band of the irradiance, or of the filtered brightness, strictly within which nothing fires.
  LargeVector<float> band_low, band_high;
  LargeVector<std::int32_t> alarms;  // in ticks

  // With in_brightness: the brightness at the last sample, and behind each pole.
  LargeVector<float> brightness, filtered1, filtered2;

  AddressedRandom per_event, per_shot, per_leak;

  /// What changes while the pixels watch, for state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.epoch);
    archive.fixed(self.clean_pixels);
    archive.fixed(self.until);
    archive.fixed(self.noisy_pixels);
    archive.fixed(self.band_low);
    archive.fixed(self.band_high);
    archive.fixed(self.alarms);
    archive.fixed(self.brightness);
    archive.fixed(self.filtered1);
    archive.fixed(self.filtered2);
  }

 private:
  static constexpr double kTicksPerNs = 1.0 / 65536;  // 39 hours fit
  static constexpr double kLastTick = 2147483646.0;

  void make_pixels(std::uint64_t seed, std::uint16_t stream);
};

/// Relative room between a band and the levels, more than the rounding of the floats that lead to it: the band may wake
/// a pixel for nothing, but never lets it sleep over a crossing.
inline constexpr double kBandGuard = 4e-6;

}  // namespace esim
