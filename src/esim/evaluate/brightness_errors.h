#pragma once

#include <array>
#include <span>
#include <vector>

#include "esim/core/log_histogram.h"
#include "esim/evaluate/reference_brightness.h"
#include "esim/evaluate/windows.h"

namespace esim::inline evaluate {

/// The errors at the pixels of one kind of place.
struct PlaceError {
  double squares = 0;  ///< sum of the squared errors
  std::int64_t values = 0;
};

/// Error of the brightness of a sampler's segments relative to the truth, in one window.
struct BrightnessError {
  std::vector<double> rmse;  ///< of each pixel, over the reference's instants in the window
  double mean_rmse = 0;      ///< mean over the pixels
  double mean_abs = 0;       ///< mean |error| over pixels and instants
  double p99_abs = 0;        ///< 99th percentile of |error|, within 2.3 %
  double max_abs = 0;
  std::int64_t values = 0;                              ///< pixels times instants
  std::array<PlaceError, kPlaceNames.size()> places{};  ///< indexed by Place; all 0 unless all pixels are compared
  std::int64_t steps = 0;                               ///< segments of a pixel that end in the window
  std::int64_t large_steps = 0;  ///< segments over which brightness changes by more than the contrast threshold
};

/// Compares segments with the reference at each instant in (t0, t1]: in a segment L is linear in time between ln(E0 +
/// log_eps) and ln(E1 + log_eps). Segments of different tiles may come in any order.
class BrightnessErrors {
 public:
  /// A window holds the instants in (start, end]. The reference must outlive this object.
  BrightnessErrors(ReferenceBrightness& reference, int width, int height, const std::vector<Window>& windows,
                   double contrast_threshold);

  void add(std::span<const Segment> segments);

  /// The errors of each window.
  std::vector<BrightnessError> finish() const;

 private:
  struct PixelSums {
    double squares = 0;
    std::int64_t count = 0;
  };
  struct WindowSums {
    TimeSpan span;
    std::int64_t first = 0, end = 0;  // instants of the reference
    std::vector<PixelSums> pixels;
    LogHistogram histogram;
    std::array<PlaceError, kPlaceNames.size()> places{};
    std::int64_t steps = 0, large_steps = 0;
  };

  void add(const Segment& segment);
  void compare(WindowSums& window, const Segment& segment, std::int64_t first, std::int64_t end);

  ReferenceBrightness& reference_;
  PixelIndex index_;
  double contrast_threshold_;
  std::vector<WindowSums> windows_;

  struct Line {
    int pixel = 0;
    double before = 0, after = 0;  // L at the segment's ends
  };
  std::vector<Line> lines_;  // of the current segment
};

}  // namespace esim::inline evaluate
