#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/events/event_packing.h"
#include "esim/sensors/event_camera_options.h"

namespace esim {

/// Before every time.
inline constexpr TimeNs kLongAgo = std::numeric_limits<TimeNs>::min();

/// In place of the reference of a pixel that is held in reset.
inline constexpr double kHeld = std::numeric_limits<double>::infinity();

/// Where a thread puts the events that it finds.
struct PackedEvents {
  const EventPacking* packing;
  std::vector<std::uint64_t>* events;

  void add(TimeNs t, int x, int y, bool on) {
    events->push_back(packing->pack(t - packing->origin, packing->place(x, y), on));
  }
};

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

  /// Sets the reference of a pixel that is first seen at time t, with this brightness, and returns G.
  double open(std::uint32_t pixel, double brightness_now, TimeNs t);

  /// What leaks, in brightness per second.
  double leak(std::uint32_t pixel) const { return leaks ? noise[pixel].leak : 0.0; }

  /// Brightness behind the low-pass at the last sample, where bands are of that.
  double filtered(std::uint32_t pixel) const {
    if (!filtered2.empty()) return filtered2[pixel];
    return filtered1.empty() ? brightness[pixel] : filtered1[pixel];
  }

  /// Asks memory for what is needed of a pixel that wakes up.
  void prefetch(std::uint32_t pixel) const {
    __builtin_prefetch(&states[pixel], 1);
    if (!noise.empty()) __builtin_prefetch(&noise[pixel], 1);
  }

  double level_on(std::uint32_t pixel) const { return states[pixel].reference + threshold_on + states[pixel].on; }
  double level_off(std::uint32_t pixel) const { return states[pixel].reference - threshold_off - states[pixel].off; }

  /// Levels of the signal without what leaks, between which the pixel can sleep from `now`, when its signal is G, until
  /// its alarm, which is set.
  struct Levels {
    float low, high;
  };
  Levels sleep(std::uint32_t pixel, TimeNs now, double signal) {
    if (alarmed) return sleep_until_alarm(pixel, now, signal);
    return {static_cast<float>(level_off(pixel)), static_cast<float>(level_on(pixel))};
  }

  /// Gives pixels the bands between these levels. The arrays have kVectorPadding elements more, and are overwritten.
  void set_bands(std::size_t count, const std::uint32_t* which, float* low, float* high);

  /// Draws the thresholds and the leak of the pixel's next event from four standard normal deviates.
  void renew(std::uint32_t pixel, const float* normals);

  /// Moves a pixel's next shot noise candidate.
  void next_shot(std::uint32_t pixel, double uniform);

  double relative_intensity(double irradiance) const {
    return (irradiance + options.dark_irradiance) / (1.0 + options.dark_irradiance);
  }
  double seconds_since_epoch(TimeNs t) const { return to_seconds(t - epoch); }
  std::int32_t ticks(TimeNs t) const;
  void empty_band(std::uint32_t pixel) {
    band_low[pixel] = std::numeric_limits<float>::infinity();
    band_high[pixel] = -std::numeric_limits<float>::infinity();
  }

  EventCameraOptions options;
  int width;
  double threshold_on, threshold_off;
  TimeNs refractory;
  bool holds;               // refractory pixels are held in reset
  TimeNs epoch = kLongAgo;  // of leaks and alarms: the first sample

  // Which parts of the model are in use.
  bool in_brightness;  // the band is one of brightness, not of irradiance
  bool leaks, shoots;  // pixels fire without a change of light
  bool alarmed;        // either
  bool renews;         // thresholds, leaks or latencies differ from event to event
  bool delays;         // time stamps come later than crossings

  /// What is needed of a pixel that wakes up. Thresholds count from the camera's.
  struct State {
    double reference = 0;   // G at the last event; kHeld while the pixel is held in reset
    float on = 0, off = 0;  // what the pixel's thresholds are above threshold_on and threshold_off
  };
  std::vector<State> states;

  std::vector<TimeNs> until;  // end of the last refractory period

  // Band of the irradiance, or of the filtered brightness, strictly within which nothing fires.
  std::vector<float> band_low, band_high;
  std::vector<std::int32_t> alarms;  // in ticks

  // With in_brightness: the brightness at the last sample, and behind each pole.
  std::vector<float> brightness, filtered1, filtered2;

  /// What is random about a pixel; where anything is.
  struct alignas(32) Noise {
    float mean_on = 0, mean_off = 0;  // of State::on and off
    float mean_leak = 0, leak = 0;    // 1/s, in brightness
    std::uint32_t draws = 0;          // for its events, so far
    std::uint32_t shots = 0;          // candidates of shot noise, so far
    TimeNs shot_at = 0;               // the next of them
  };
  std::vector<Noise> noise;

  AddressedRandom per_event, per_shot, per_leak;

 private:
  Levels sleep_until_alarm(std::uint32_t pixel, TimeNs now, double signal);
  void draw_first_thresholds();
  void set_thresholds(State& state, double above_on, double above_off);
};

/// Relative room between a band and the levels, more than the rounding of the floats that lead to it: the band may wake
/// a pixel for nothing, but never lets it sleep over a crossing.
inline constexpr double kBandGuard = 4e-6;

}  // namespace esim
