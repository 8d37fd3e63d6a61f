// Accelerates next_event() in reference.cpp, (6) to (12), for a block of pixels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "esim/event_camera/effects/effects.h"
#include "esim/event_camera/pixel/linear_signals.h"
#include "esim/event_camera/pixel/pixel_array.h"
#include "esim/event_camera/pixel/pixel_block.h"
#include "esim/event_camera/pixel/relaxing_signals.h"
#include "esim/events/packed_events.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Advances active pixels through a segment, with all random effects. In each round, every pixel of a block fires at
/// most one event, in vectors. Keep the object for its working memory.
template <class Signals>
class PixelPass {
 public:
  /// The signals of the comparators; set them for the pixels that take() added.
  Signals signals;

  /// Takes the new active pixels between t0 and t1: those in `active` after the ones that the last round() left, in the
  /// same segment. Removes from `active` those that stay in reset. Returns the index of the first new pixel.
  std::size_t take(const PixelArray& pixels, ActivePixels& active, TimeNs t0, TimeNs t1);

  /// Adds the next event of each pixel that fires to `events`, in any order. `active` keeps the pixels that may fire
  /// again; with `wait`, none: pixels then stay in reset after their event until it has been read out.
  void round(PixelArray& pixels, ActivePixels& active, PackedEvents& events, bool wait = false);

  /// Restores the values that pixels drew after the last of their events.
  void draw_again(PixelArray& pixels, const ActivePixels& active);

  /// Instead of rounds at the pixels' first sample, t0 = t1: sets their references.
  void open(PixelArray& pixels, ActivePixels& active);

 private:
  void resume_held();

  // The steps of a round, for all remaining pixels.
  void take_apart(const PixelArray& pixels);
  void renew(const PixelArray& pixels);
  void fire(const PixelArray& pixels);
  void label(PackedEvents& events) const;
  void reset(const PixelArray& pixels, bool wait);
  void deactivate(PixelArray& pixels, ActivePixels& active);

  void keep(ActivePixels& active, std::size_t i, std::size_t to);
  void write_back(const PixelEffects& effects, PixelArray::NoisyPixel& state, std::size_t i) const;

  TimeNs t0_ = 0;
  double epoch_ns_ = 0;  // from the epoch to t0

  // Pixels that have not resumed yet, and whose refractory period ends in the segment.
  PerPixel<std::uint32_t> held_{};
  std::size_t held_count_ = 0;

  // Per remaining pixel. Times are in ns after t0.
  Round round_;
  PixelEffects::Lanes lanes_;
  PerPixel<std::uint32_t> draws_{};  // number of draws for events
  PerPixel<double> until_{};         // end of the last refractory period
  PerPixel<double> reports_{};       // 0 if the event is lost
  PerPixel<double> again_{};         // 1 if another event may follow

  // With labels.
  PerPixel<double> set_at_{};  // when the reference was set; 0 without a leak
  PerPixel<float> signal_{}, noise_{}, leak_{};

  // The bounds of inactive pixels.
  PerPixel<float> low_{}, high_{};
  PerPixel<std::int32_t> timer_{};
};

extern template class PixelPass<LinearSignals>;
extern template class PixelPass<RelaxingSignals>;

}  // namespace esim::inline event_camera
