// The state of struct Pixel in reference.cpp, and the fixed parameters of (7) and (10), for all pixels.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/large_vector.h"
#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/event_camera/effects/effects.h"
#include "esim/event_camera/options.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Earlier than every time, but such that differences do not overflow.
inline constexpr TimeNs kLongAgo = std::numeric_limits<TimeNs>::min() / 2;

/// Later than every time, likewise.
inline constexpr TimeNs kFarAhead = std::numeric_limits<TimeNs>::max() / 2;

/// Replaces the reference of a pixel that is held in reset.
inline constexpr double kHeld = std::numeric_limits<double>::infinity();

/// The state and the individual parameters of a camera's pixels.
///
/// A pixel compares G, its brightness after the low-pass plus the drift since the epoch, with its reference. It is
/// inactive while its signal stays within bounds around the reference, inside which no event is possible, and until its
/// timer expires. In most segments these comparisons suffice for most pixels.
class PixelArray {
 public:
  PixelArray(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);

  /// Whether each pixel is hot; empty if none is.
  std::vector<bool> hot(std::uint64_t seed, std::uint16_t stream) const;

  /// Sets the time origin of drifts and timers, unless it is set.
  void set_epoch(TimeNs t) {
    if (epoch == kLongAgo) epoch = t;
  }

  /// Sets the bounds of pixels. The arrays need kVectorPadding more elements, and are overwritten.
  void set_bounds(std::size_t count, const std::uint32_t* which, float* low, float* high);

  /// Holds a pixel in reset until a time, whatever its state.
  void hold(std::uint32_t pixel, TimeNs until);
  /// Reverts the last `events` events of a pixel. It must then be held until `until`, because its reference is lost.
  void take_back(std::uint32_t pixel, std::uint32_t events, TimeNs until);

  /// Prefetches the state of a pixel that becomes active.
  void prefetch(std::size_t pixel) const {
    if (effects.clean) {
      __builtin_prefetch(&clean_pixels[pixel], 1);
    } else {
      __builtin_prefetch(&noisy_pixels[pixel], 1);
      if (!set_at.empty()) __builtin_prefetch(&set_at[pixel], 1);
    }
  }

  void empty_bounds(std::uint32_t pixel) {
    bound_low[pixel] = std::numeric_limits<float>::infinity();
    bound_high[pixel] = -std::numeric_limits<float>::infinity();
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
  TimeNs epoch = kLongAgo;  // time origin of drifts and timers: the first sample

  ActiveEffects effects;

  // The state of active pixels, stored per pixel. Thresholds are relative to the camera's.

  struct CleanPixel {
    double reference = 0;   // G at the last event; kHeld while the pixel is held in reset
    float on = 0, off = 0;  // the pixel's thresholds relative to threshold_on and threshold_off
  };
  LargeVector<CleanPixel> clean_pixels;
  LargeVector<TimeNs> until;  // end of the reset of clean pixels

  struct alignas(64) NoisyPixel : PixelEffects::States {
    double reference = 0;
    float on = 0, off = 0;
    float drift = 0;           // 1/s
    std::uint32_t draws = 0;   // number of draws for its events
    double until = -kNeverNs;  // end of the last refractory period, ns after the epoch
  };
  LargeVector<NoisyPixel> noisy_pixels;

  // With labels and a leak: when each reference was set, ns after the epoch.
  LargeVector<double> set_at;

  // Bounds of the irradiance, or of the filtered brightness; strictly within them no event is possible.
  LargeVector<float> bound_low, bound_high;
  LargeVector<std::int32_t> timers;  // timers, in ticks

  // With effects.in_brightness: the brightness at the last sample, and after each pole.
  LargeVector<float> brightness, filtered1, filtered2;

  AddressedRandom per_event;

  /// The variable state, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.epoch);
    archive.fixed(self.clean_pixels);
    archive.fixed(self.until);
    archive.fixed(self.noisy_pixels);
    archive.fixed(self.set_at);
    archive.fixed(self.bound_low);
    archive.fixed(self.bound_high);
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
inline constexpr double kBoundMargin = 4e-6;

}  // namespace esim::inline event_camera
