// Accelerates (5) and (6), reference_signal.h with one pole, for a block of pixels.
#pragma once

#include "esim/event_camera/pixel/pixel_block.h"
#include "esim/event_camera/pixel/relaxing_signal.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// RelaxingSignal for the pixels of a block, in vectors if there is one pole. Floats, relative to the reference, decide
/// which signals leave their levels; doubles determine when, and the values.
class RelaxingSignals {
 public:
  /// Takes the active pixels from index `first` on, at the segment's start; `active` must outlive their use.
  void take(const ActivePixels& active, std::size_t first, int poles, double duration);

  /// Finds the first time at which each signal leaves its levels, from `from` to the segment's end.
  void find(Comparators& c);
  /// Advances to `from`.
  void advance(const Comparators& c);
  void advance(const Comparators& c, std::size_t i);
  /// again[i] = 1 if the signal, between its levels at `from`, may leave them before the segment's end; otherwise 0.
  void look_ahead(const Comparators& c, double* again) const;

  double value(std::size_t i) const { return value_[i]; }                   ///< F at `from`
  double end(std::size_t i) const { return static_cast<double>(end_[i]); }  ///< F at the segment's end
  void copy(std::size_t i, std::size_t to);

  /// One of the signals, plus its drift.
  RelaxingSignal signal(const Comparators& c, std::size_t i) const;

 private:
  struct Span;
  struct Solver;

  template <class D>
  void advance(D d, const Comparators& c, std::size_t i);
  void guess(Comparators& c);
  void solve(Comparators& c);
  void find_one(Comparators& c, std::size_t i) const;

  const ActivePixels* active_ = nullptr;
  int poles_ = 1;
  double duration_ = 0;
  PerPixel<float> rise_{};         // of the input, per u
  PerPixel<float> u_{}, moved_{};  // at `from`
  PerPixel<double> value_{};       // F there
  PerPixel<float> end_{};          // F at the segment's end

  PerPixel<float> guess_{};            // approximate u at the crossing
  PerPixel<std::uint32_t> unclear_{};  // signals to process one by one
  std::size_t unclear_count_ = 0;
};

}  // namespace esim::inline event_camera
