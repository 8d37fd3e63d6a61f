#pragma once

#include <cstdint>
#include <vector>

#include "esim/render/sample.h"
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

/// Takes the pixels that woke up through a segment. Private to the event camera; holds memory to work in.
template <class Signal>
class PixelPass {
 public:
  /// Makes room for so many more pixels.
  void reserve(std::size_t more) {
    if (awake_.size() < count_ + more) awake_.resize(2 * (count_ + more)), signals_.resize(2 * (count_ + more));
  }
  /// Appends a pixel; where `signal` is not given, it is to be set before run().
  void add(const AwakePixel& pixel) { awake_[count_++] = pixel; }
  void add(const AwakePixel& pixel, const Signal& signal) {
    signals_[count_] = signal;
    awake_[count_++] = pixel;
  }
  std::size_t count() const { return count_; }
  const AwakePixel& pixel(std::size_t i) const { return awake_[i]; }
  Signal& signal(std::size_t i) { return signals_[i]; }

  /// Gives the pixels the bands that follow from their references at time t, and forgets them.
  void settle_all(PixelArray& pixels, TimeNs t);

  /// Adds the pixels' events to `events`, in any order, and forgets the pixels.
  void run(PixelArray& pixels, TimeNs t0, TimeNs t1, PackedEvents& events);

 private:
  /// The event that a pixel is about to fire.
  struct Next {
    double tau = 0;    // ns after the segment's start
    double level = 0;  // the new reference, in G
    std::int8_t polarity = 0;
    bool noise = false;
  };

  template <bool kNoisy>
  void run_each(PixelArray& pixels, PackedEvents& events);
  void run_in_rounds(PixelArray& pixels, PackedEvents& events);
  bool begin(PixelArray& pixels, std::size_t i);
  template <bool kNoisy>
  bool find(PixelArray& pixels, const AwakePixel& awake, const Signal& signal, Next& next);
  Crossing shot_before(PixelArray& pixels, const AwakePixel& awake, const Signal& signal, Crossing crossing) const;
  void renew(PixelArray& pixels);
  template <bool kNoisy>
  bool fire(PixelArray& pixels, const AwakePixel& awake, Signal& signal, const Next& next, const float* normals,
            PackedEvents& events) const;
  TimeNs delay(const PixelArray& pixels, const AwakePixel& awake, double tau, const float* normals) const;
  void settle(PixelArray& pixels, std::uint32_t pixel);
  void make_room();

  TimeNs t0_ = 0, t1_ = 0;
  double duration_ = 0;  // ns
  double epoch_s_ = 0;   // from the epoch to t0

  std::vector<AwakePixel> awake_;
  std::vector<Signal> signals_;
  std::size_t count_ = 0;  // of both

  // Pixels that are done, with the levels that they sleep between.
  std::vector<std::uint32_t> settled_;
  std::vector<float> low_, high_;
  std::size_t settled_count_ = 0;

  // For the rounds.
  std::vector<Next> next_;
  EventNormals normals_;
  std::vector<std::uint32_t> firing_;
};

extern template class PixelPass<LinearSignal>;
extern template class PixelPass<RelaxingSignal>;

}  // namespace esim
