#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/light/flicker.h"
#include "esim/render/sample.h"

// Private to frame_camera.
namespace esim::inline frame_camera {

/// A frame during its exposure: accumulates the mean irradiance of each pixel over its row's exposure.
///
/// Between two samples irradiance is linear in time, times the light's modulation, so that its integral is exact. (A
/// straight line in the logarithm would lie below it: moving edges would reduce the irradiance.)
class Exposure {
 public:
  /// Row y is exposed from first_row + row_delays[y] on; the delays must outlive the exposure.
  Exposure(std::int64_t number, TimeNs first_row, TimeNs duration, std::span<const TimeNs> row_delays)
      : number_(number), first_row_(first_row), duration_(duration), row_delays_(row_delays) {}

  std::int64_t number() const { return number_; }                             ///< of the frame
  TimeNs first_row() const { return first_row_; }                             ///< start of the first row's exposure
  TimeNs duration() const { return duration_; }                               ///< of each row
  TimeNs end() const { return first_row_ + row_delays_.back() + duration_; }  ///< end of the last row's exposure
  bool overlaps(TimeNs t0, TimeNs t1) const { return t0 < end() && t1 > first_row_; }

  /// Provides memory for the sums; call before the first add().
  void open(Image<float> memory);
  bool is_open() const { return !mean_.empty(); }

  /// Adds rows of a segment in a light; null: constant. False if an irradiance is not a finite number >= 0.
  bool add(const Segment& segment, Rows rows, const SegmentLight* light);

  const Image<float>& mean() const { return mean_; }
  /// Sets the sums of an exposure that was saved; empty: not open yet.
  void restore(Image<float> mean) { mean_ = std::move(mean); }
  Image<float> take_memory() { return std::move(mean_); }

 private:
  /// Of a segment's ends in the mean of a row.
  struct Weights {
    float first, last;
  };
  Weights weigh(const Segment& segment, TimeNs begin, const SceneLight* light, std::size_t which) const;
  bool add_lights(const Segment& segment, int y, const SegmentLight& light, std::span<const Weights> weights);

  std::int64_t number_;
  TimeNs first_row_, duration_;
  std::span<const TimeNs> row_delays_;
  Image<float> mean_;
};

}  // namespace esim::inline frame_camera
