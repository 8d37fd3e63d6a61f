#pragma once

#include <cstddef>
#include <cstdint>

#include "esim/events/packed_events.h"
#include "esim/sensors/linear_signals.h"
#include "esim/sensors/pixel_array.h"
#include "esim/sensors/pixel_block.h"
#include "esim/sensors/pixel_normals.h"
#include "esim/sensors/relaxing_signals.h"

namespace esim {

/// Takes the pixels that woke up through a segment, with all that is random about them. All of a block take one event
/// at a time, in vectors. Private to the event camera; memory to work in, to be kept.
template <class Signals>
class PixelPass {
 public:
  /// What the comparators see of the pixels: to be set for those that take() has taken.
  Signals signals;

  /// Takes pixels that woke up between t0 and t1: those of `awake` behind the ones that the last round() left, in the
  /// same segment. Removes from `awake` those that stay in reset. Returns the index of the first.
  std::size_t take(const PixelArray& pixels, AwakePixels& awake, TimeNs t0, TimeNs t1);

  /// Adds to `events`, in any order, the next event of each that fires. In `awake` are left those that may fire again:
  /// none where pixels wait after their event, in reset, until they are told that it has been read out.
  void round(PixelArray& pixels, AwakePixels& awake, PackedEvents& events, bool wait = false);

  /// Gives pixels what was drawn after the last of the events that they have drawn for.
  void draw_again(PixelArray& pixels, const AwakePixels& awake);

  /// Instead of rounds where the pixels are first seen, at t0 = t1: sets their references.
  void open(PixelArray& pixels, AwakePixels& awake);

 private:
  void resume_held();

  // The steps of a round, for all pixels that are left.
  void find_shots(const PixelArray& pixels, const AwakePixels& awake);
  void find_shot(const PixelArray& pixels, const AwakePixels& awake, std::size_t i);
  void renew(const PixelArray& pixels, const AwakePixels& awake);
  void fire(const PixelArray& pixels, const AwakePixels& awake, const EventPacking& packing);
  void delay(const PixelArray& pixels, const AwakePixels& awake, const EventPacking& packing);
  void reset(const PixelArray& pixels, bool wait);
  void sleep(PixelArray& pixels, AwakePixels& awake);

  void draw_uniforms(const AddressedRandom& random, const AwakePixels& awake, std::uint32_t draw);
  void keep(AwakePixels& awake, std::size_t i, std::size_t to);
  void write_back(PixelArray::NoisyPixel& own, std::size_t i) const;

  TimeNs t0_ = 0;
  double duration_ = 0;  // ns
  double epoch_ns_ = 0;  // from the epoch to t0

  // Pixels whose refractory period ends in the segment, and that have not resumed yet.
  PerPixel<std::uint32_t> held_{};
  std::size_t held_count_ = 0;

  // By pixel that is left. Times are ns after t0.
  Comparators compare_{};
  PerPixel<std::uint32_t> draws_{}, shots_{};
  PerPixel<float> mean_on_{}, mean_off_{}, mean_leak_{};
  PerPixel<double> shot_{};     // the next candidate of shot noise
  PerPixel<double> until_{};    // end of the last refractory period
  PerPixel<double> passed_{};   // the level that the event passed
  PerPixel<double> anew_{};     // 1 where the event is none of the light: the reference is the signal of the moment
  PerPixel<double> stamp_{};    // of the event
  PerPixel<double> reports_{};  // 0 where the event is lost
  PerPixel<double> again_{};    // 1 where another event may follow
  PixelNormals normals_{};
  PerPixel<double> uniform_{};

  // The levels that pixels sleep between.
  PerPixel<float> low_{}, high_{};
  PerPixel<std::int32_t> alarm_{};
};

extern template class PixelPass<LinearSignals>;
extern template class PixelPass<RelaxingSignals>;

}  // namespace esim
