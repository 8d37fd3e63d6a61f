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
/// In each, `brightness` is null or replaces what follows from the irradiance. False, and nothing is done, where an
/// irradiance is not a finite number >= 0.
class PixelUpdate {
 public:
  /// Of a segment that is an instant: sets the references.
  bool open(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows);

  /// Of any other: adds what the pixels fire to `events`.
  bool advance(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows,
               PackedEvents& events);

 private:
  bool cross(PixelArray& pixels, const Segment& segment, Rows rows, PackedEvents& events);
  bool filter(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows,
              PackedEvents& events);

  /// The pixels of a row that woke up: brightness at the segment's ends, behind the poles at its start, and how many
  /// time constants it lasts.
  struct Woken {
    std::vector<std::uint32_t> column;
    std::vector<float> start, end, filtered1, filtered2, phase, moved;
    std::size_t count = 0;

    void begin(std::size_t most) {
      count = 0;
      if (column.size() >= most) return;
      column.resize(most);
      for (auto* values : {&start, &end, &filtered1, &filtered2, &phase, &moved}) values->resize(most);
    }
  };

  struct Filter;
  template <int kOrder>
  void take_woken(PixelArray& pixels, const Segment& segment, const Filter& filter, int y);
  template <int kOrder>
  void filter_row(PixelArray& pixels, const Segment& segment, const Filter& filter, const Image<float>* brightness,
                  int y);
  template <int kOrder, class D>
  void filter_vector(D d, PixelArray& pixels, const Segment& segment, const Filter& filter, const float* brightness,
                     int y, int x);
  const float* brightness_row(const PixelArray& pixels, const Segment& segment, const Image<float>* brightness, int y);

  PixelWatch watch_;
  Woken woken_;
  CleanPass clean_;
  PixelPass<LinearSignal> linear_;
  PixelPass<RelaxingSignal> relaxing_;
  std::vector<double> before_, after_;  // light, then brightness, at the segment's ends of each pixel that is awake
  std::vector<float> row_;              // brightness at the segment's end
};

}  // namespace esim
