#pragma once

#include <cstdint>
#include <vector>

#include "esim/sensors/event_normals.h"
#include "esim/sensors/pixel_array.h"
#include "esim/sensors/pixel_signal.h"

namespace esim {

/// A pixel that woke up in a segment.
struct AwakePixel {
  std::uint32_t pixel;
  std::uint16_t x, y;
  float light0, light1;  ///< irradiance at the segment's ends
};

/// Takes the pixels that woke up through a segment. All take one event at a time, so that random numbers and
/// exponentials are computed for many pixels at once. Private to the event camera; holds memory to work in.
template <class Signal>
class PixelPass {
 public:
  /// Makes room for so many more pixels.
  void reserve(std::size_t more);

  /// Appends a pixel; where `signal` is not given, it is to be set before run().
  void add(const AwakePixel& pixel) { awake_[count_++] = pixel; }
  void add(const AwakePixel& pixel, const Signal& signal) {
    signals_[count_] = signal;
    awake_[count_++] = pixel;
  }
  std::size_t count() const { return count_; }
  const AwakePixel& pixel(std::size_t i) const { return awake_[i]; }
  Signal& signal(std::size_t i) { return signals_[i]; }

  /// Gives the pixels the bands that follow from their references and signals at time t, and forgets them.
  void settle_all(PixelArray& pixels, TimeNs t);

  /// Adds the pixels' events to `events`, in any order, and forgets the pixels.
  void run(PixelArray& pixels, TimeNs t0, TimeNs t1, PackedEvents& events);

 private:
  /// The event that a pixel is about to fire.
  struct Next {
    double tau = 0;        // ns after the segment's start
    double reference = 0;  // the level that it passed, in G
    std::int8_t polarity = 0;
    bool noise = false;
  };

  // The steps of a round, for all pixels that are left. Those that are done are dropped on the way.
  void begin(PixelArray& pixels);
  void find(PixelArray& pixels);
  void renew(PixelArray& pixels);
  void fire(PixelArray& pixels, PackedEvents& events);
  void resume(PixelArray& pixels);

  void keep(std::size_t from, std::size_t to);
  Crossing shot_before(PixelArray& pixels, std::size_t i, Crossing crossing) const;
  TimeNs delay(const PixelArray& pixels, std::size_t i) const;
  void settle(PixelArray& pixels, std::size_t i);
  void set_bands(PixelArray& pixels);

  TimeNs t0_ = 0, t1_ = 0;
  double duration_ = 0;  // ns
  double epoch_s_ = 0;   // from the epoch to t0

  // By pixel that is left.
  std::vector<AwakePixel> awake_;
  std::vector<Signal> signals_;
  std::vector<Next> next_;
  std::vector<double> level_low_, level_high_, from_;
  std::vector<Crossing> crossings_;
  std::size_t count_ = 0;

  // By pixel that is done: the levels that it sleeps between.
  std::vector<std::uint32_t> settled_;
  std::vector<float> low_, high_;
  std::size_t settled_count_ = 0;

  EventNormals normals_;
  std::vector<EventNormals::Address> firing_;
};

extern template class PixelPass<LinearSignal>;
extern template class PixelPass<RelaxingSignal>;

}  // namespace esim
