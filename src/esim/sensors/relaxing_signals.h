#pragma once

#include "esim/sensors/pixel_block.h"
#include "esim/sensors/relaxing_signal.h"

namespace esim {

/// RelaxingSignal for the pixels of a block, in vectors as far as there is one pole: which of them leave their levels
/// is decided in floats, relative to the reference; when they do, and what they are then, in doubles.
class RelaxingSignals {
 public:
  /// Takes those of `awake` from the `first` one on, which must stay there, to the segment's start.
  void take(const AwakePixels& awake, std::size_t first, int poles, double duration);

  /// Finds when each signal first leaves its levels, between `from` and the segment's end.
  void find(Comparators& c);
  /// Moves on to `from`.
  void advance(const Comparators& c);
  void advance(const Comparators& c, std::size_t i);
  /// again[i] = 1 where the signal, between its levels at `from`, may leave them until the segment's end; otherwise 0.
  void look_ahead(const Comparators& c, double* again) const;

  double value(std::size_t i) const { return value_[i]; }                   ///< F at `from`
  double end(std::size_t i) const { return static_cast<double>(end_[i]); }  ///< F at the segment's end
  void copy(std::size_t i, std::size_t to);

  /// One of them, plus what leaks.
  RelaxingSignal signal(const Comparators& c, std::size_t i) const;

 private:
  struct Span;
  struct Solver;

  template <class D>
  void advance(D d, const Comparators& c, std::size_t i);
  void guess(Comparators& c);
  void solve(Comparators& c);
  void find_one(Comparators& c, std::size_t i) const;

  const AwakePixels* awake_ = nullptr;
  int poles_ = 1;
  double duration_ = 0;
  PerPixel<float> rise_{};         // of the input, per u
  PerPixel<float> u_{}, moved_{};  // at `from`
  PerPixel<double> value_{};       // F there
  PerPixel<float> end_{};          // F at the segment's end

  PerPixel<float> guess_{};            // u at the crossing, nearly
  PerPixel<std::uint32_t> unclear_{};  // those to be looked at one by one
  std::size_t unclear_count_ = 0;
};

}  // namespace esim
