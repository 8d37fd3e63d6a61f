#pragma once

#include <cstdint>
#include <vector>

#include "esim/core/image.h"
#include "esim/render/sample.h"
#include "esim/sensors/clean_pass.h"
#include "esim/sensors/pixel_array.h"
#include "esim/sensors/pixel_pass.h"
#include "esim/sensors/pixel_watch.h"

namespace esim {

/// Brings rows of pixels from the beginning of a segment to its end. One for each thread, as memory to work in. Private
/// to the event camera.
///
/// In each, `brightness` is null or replaces what follows from the irradiance.
class PixelUpdate {
 public:
  /// Rows [first, last) of a segment that is an instant: sets the references.
  void open(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, int first, int last);

  /// Takes the pixels that woke up through the segment.
  void cross(PixelArray& pixels, const Segment& segment, const PixelWatch& watch, int first, int last,
             PackedEvents& events);

  /// The same where bands are of brightness: moves all low-passes on, and takes those pixels through the segment whose
  /// filtered brightness may leave its band.
  void filter(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, int first, int last,
              PackedEvents& events);

 private:
  template <int kOrder>
  void filter_row(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, int y);
  template <int kOrder, class D>
  void filter_vector(D d, PixelArray& pixels, const Segment& segment, const float* brightness, int y, int x);
  const float* brightness_row(const PixelArray& pixels, const Segment& segment, const Image<float>* brightness, int y);

  CleanPass clean_;
  PixelPass<LinearSignal> linear_;
  PixelPass<RelaxingSignal> relaxing_;
  std::vector<double> before_, after_;  // light, then brightness, at the segment's ends of each pixel that is awake
  std::vector<float> row_;              // brightness at the segment's end
};

}  // namespace esim
