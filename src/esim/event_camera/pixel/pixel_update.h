// Accelerates process() in reference.cpp for rows of pixels, with the low-pass (5).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/event_camera/pixel/clean_pass.h"
#include "esim/event_camera/pixel/pixel_array.h"
#include "esim/event_camera/pixel/pixel_block.h"
#include "esim/event_camera/pixel/pixel_pass.h"
#include "esim/event_camera/pixel/pixel_watch.h"
#include "esim/event_camera/segment_history.h"
#include "esim/render/sample.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// Advances rows of pixels from the start of a segment to its end. Use one object per thread, for its working memory.
///
/// `brightness`, if not null, replaces the brightness from the irradiance. The functions return false, and change
/// nothing, if an irradiance is not a finite number >= 0.
class PixelUpdate {
 public:
  /// For a segment that is an instant: sets the references.
  bool open(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows);

  /// For any other segment: adds the pixels' events to `events`. `past`, if not null, receives the state at its start.
  bool advance(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows, PastSegment* past,
               PackedEvents& events);

  /// Lets pixels that are held in reset resume in a past segment. Each pixel fires at most once, and then waits in
  /// reset; the others are advanced to the segment's end.
  void resume(PixelArray& pixels, const PastSegment& past, std::span<const std::uint32_t> which, PackedEvents& events);

  /// Restores the values that pixels drew after the last of their events.
  void draw_again(PixelArray& pixels, std::span<const std::uint32_t> which);

 private:
  bool cross(PixelArray& pixels, const Segment& segment, Rows rows, PackedEvents& events);
  bool filter(PixelArray& pixels, const Segment& segment, const Image<float>* brightness, Rows rows, PastSegment* past,
              PackedEvents& events);

  struct Filter;
  struct FilterRow;
  template <int kOrder>
  void filter_row(PixelArray& pixels, const Segment& segment, const Filter& filter, const float* brightness, int y,
                  PastSegment* past, PackedEvents& events);
  template <int kOrder, class D>
  void move_vector(D d, const FilterRow& row, const Filter& filter, int x, int at);
  template <int kOrder, class D>
  std::span<const std::uint32_t> move(D d, const PixelArray& pixels, const FilterRow& row, const Filter& filter,
                                      int begin, int end);
  template <int kOrder>
  void activate(const FilterRow& row, int begin, std::span<const std::uint32_t> columns);
  void gather(const PixelArray& pixels, const PastSegment& past, std::span<const std::uint32_t> which,
              const EventPacking& packing);
  void find_phases(const Filter& filter);
  template <int kOrder>
  void run_active(PixelArray& pixels, const Segment& segment, bool all, PackedEvents& events);
  const float* brightness_row(const PixelArray& pixels, const Segment& segment, const Image<float>* given, int y);

  /// The low-passes of neighbouring pixels at the segment's end, and the pixels that become active.
  static constexpr int kMovedTogether = 128;
  struct MovedPixels {
    std::array<float, kMovedTogether> filtered1, filtered2, phase, moved;
    std::array<std::uint8_t, kMovedTogether> leaving;  // one bit per lane of a vector
    std::array<std::uint32_t, kMovedTogether + kVectorPadding> columns;
  };

  PixelWatch watch_;
  CleanPass clean_;
  MovedPixels moved_;
  ActivePixels active_;
  std::size_t prefetched_ = 0;  // number of active pixels that have been prefetched
  PixelPass<LinearSignals> linear_;
  PixelPass<RelaxingSignals> relaxing_;
  std::vector<double> row_;       // brightness at the first sample
  std::vector<float> float_row_;  // brightness at the segment's end
};

}  // namespace esim::inline event_camera
