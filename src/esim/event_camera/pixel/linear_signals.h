// Accelerates (3) and (6), reference_signal.h without poles, for a block of pixels.
#pragma once

#include "esim/event_camera/pixel/pixel_block.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The signals of comparators without a low-pass: straight lines in brightness.
class LinearSignals {
 public:
  /// Takes the brightness of the active pixels from index `first` on.
  void take(const ActivePixels& active, std::size_t first, double duration);
  /// Takes the logarithm of their irradiance plus eps.
  void take_light(const ActivePixels& active, std::size_t first, double eps, double duration);
  void set(std::size_t i, double start, double end) { start_[i] = start, end_[i] = end; }

  /// Finds the first time at which each of the first `count` signals leaves its levels, from `from` to the segment's
  /// end.
  void find(Comparators& c) const;
  /// Advances to `from`.
  void advance(const Comparators& c);
  void advance(const Comparators& c, std::size_t i) { value_[i] = start_[i] + slope(i) * c.from[i]; }
  /// again[i] = 1 if the signal, between its levels at `from`, may leave them before the segment's end; otherwise 0.
  void look_ahead(const Comparators& c, double* again) const;

  double value(std::size_t i) const { return value_[i]; }  ///< F at `from`
  double end(std::size_t i) const { return end_[i]; }      ///< F at the segment's end
  void copy(std::size_t i, std::size_t to) { start_[to] = start_[i], end_[to] = end_[i], value_[to] = value_[i]; }

 private:
  double slope(std::size_t i) const { return (end_[i] - start_[i]) * per_duration_; }

  double duration_ = 0, per_duration_ = 0;
  PerPixel<double> start_{}, end_{}, value_{};
};

}  // namespace esim::inline event_camera
