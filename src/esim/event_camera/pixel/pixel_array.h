#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/event_camera/options.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Earlier than every time, but such that differences do not overflow.
inline constexpr TimeNs kLongAgo = std::numeric_limits<TimeNs>::min() / 2;

/// Later than every time, likewise.
inline constexpr TimeNs kFarAhead = std::numeric_limits<TimeNs>::max() / 2;

/// Effectively never, ns: three years.
inline constexpr double kAges = 1e17;

/// Replaces the reference of a pixel that is held in reset.
inline constexpr double kHeld = std::numeric_limits<double>::infinity();

/// The state and the individual parameters of a camera's pixels.
///
/// A pixel compares G, its brightness after the low-pass plus the leak since the epoch, with its reference. It is
/// inactive while its signal stays within bounds around the reference, inside which no event is possible, and until its
/// timer expires. In most segments these comparisons suffice for most pixels.
class PixelArray {
 public:
  PixelArray(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);

  /// Sets the time origin of leaks and timers, unless it is set.
  void set_epoch(TimeNs t) {
    if (epoch == kLongAgo) epoch = t;
  }

  /// Sets the bounds of pixels. The arrays need kVectorPadding more elements, and are overwritten.
  void set_bands(std::size_t count, const std::uint32_t* which, float* low, float* high);

  /// Holds a pixel in reset until a time, whatever its state.
  void hold(std::uint32_t pixel, TimeNs until);
  /// Reverts the last `events` events of a pixel. It must then be held until `until`, because its reference is lost.
  void take_back(std::uint32_t pixel, std::uint32_t events, TimeNs until);

  /// Prefetches the state of a pixel that becomes active.
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
  bool acknowledged;        // a readout acknowledges events: refractory periods begin when an event has been read out
  bool holds;               // pixels are held in reset from their event to the end of the refractory period
  bool drops;               // events that fall into a refractory period are lost
  TimeNs epoch = kLongAgo;  // time origin of leaks and timers: the first sample

  // Which parts of the model are in use.
  bool in_brightness;  // bounds are of brightness, not of irradiance
  bool leaks, shoots;  // pixels fire without a change of irradiance
  bool has_timers;     // of leaks or shot noise
  bool renews;         // thresholds, leaks or latencies differ from event to event
  bool delays;         // time stamps are later than crossings
  bool clean;          // only changes of irradiance make pixels fire, and bounds are of irradiance

  // The state of active pixels, stored per pixel. Thresholds are relative to the camera's.

  struct CleanPixel {
    double reference = 0;   // G at the last event; kHeld while the pixel is held in reset
    float on = 0, off = 0;  // the pixel's thresholds relative to threshold_on and threshold_off
  };
  LargeVector<CleanPixel> clean_pixels;
  LargeVector<TimeNs> until;  // end of the reset of clean pixels

  struct alignas(64) NoisyPixel {
    double reference = 0;
    float on = 0, off = 0, mean_on = 0, mean_off = 0;
    float leak = 0, mean_leak = 0;  // 1/s, in brightness
    std::uint32_t draws = 0;        // number of draws for its events
    std::uint32_t shots = 0;        // number of candidates of shot noise
    double shot_at = 0;             // next candidate, ns after the epoch
    double until = -kAges;          // end of the last refractory period, likewise
  };
  LargeVector<NoisyPixel> noisy_pixels;

  // Bounds of the irradiance, or of the filtered brightness; strictly within them no event is possible.
  LargeVector<float> band_low, band_high;
  LargeVector<std::int32_t> timers;  // timers, in ticks

  // With in_brightness: the brightness at the last sample, and after each pole.
  LargeVector<float> brightness, filtered1, filtered2;

  AddressedRandom per_event, per_shot, per_leak;

  /// The variable state, for state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.epoch);
    archive.fixed(self.clean_pixels);
    archive.fixed(self.until);
    archive.fixed(self.noisy_pixels);
    archive.fixed(self.band_low);
    archive.fixed(self.band_high);
    archive.fixed(self.timers);
    archive.fixed(self.brightness);
    archive.fixed(self.filtered1);
    archive.fixed(self.filtered2);
  }

 private:
  static constexpr double kTicksPerNs = 1.0 / 65536;  // 39 hours fit
  static constexpr double kLastTick = 2147483646.0;

  void make_pixels(std::uint64_t seed, std::uint16_t stream);
};

/// Relative margin between bounds and levels, larger than the rounding errors of floats: a pixel may become active
/// unnecessarily, but never misses a crossing.
inline constexpr double kBandGuard = 4e-6;

}  // namespace esim::inline event_camera
