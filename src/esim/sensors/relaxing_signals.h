#pragma once

#include "esim/sensors/pixel_block.h"
#include "esim/sensors/relaxing_signal.h"

namespace esim {

/// RelaxingSignal for the pixels of a block, in vectors as far as there is one pole.
class RelaxingSignals {
 public:
  void take(const AwakePixels& awake, int poles, double duration);

  /// Finds when each signal first leaves its levels, between `from` and the segment's end.
  void find(Comparators& c) const;
  /// Moves on to `from`.
  void advance(const Comparators& c);
  void advance(const Comparators& c, std::size_t i);
  /// again[i] = 1 where the signal, between its levels at `from`, may leave them until the segment's end; otherwise 0.
  void look_ahead(const Comparators& c, double* again) const;

  double value(std::size_t i) const { return value_[i]; }  ///< F at `from`
  double end(std::size_t i) const { return end_[i]; }      ///< F at the segment's end
  void copy(std::size_t i, std::size_t to);

  /// One of them, plus what leaks.
  RelaxingSignal signal(const Comparators& c, std::size_t i) const;

 private:
  struct Finder;

  int poles_ = 1;
  double duration_ = 0;
  PerPixel<double> phase_{}, start_{}, rise_{};           // u at the segment's end; the input's start and rise per u
  PerPixel<double> filtered1_{}, filtered2_{}, moved_{};  // at the segment's start; m at its end
  PerPixel<double> u_{}, value_{}, slope_{};              // at `from`: F, and dF/du
  PerPixel<double> end_{}, end_slope_{};                  // at the segment's end
};

}  // namespace esim
