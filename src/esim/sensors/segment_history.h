#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/render/sample.h"
#include "esim/sensors/pixel_array.h"

namespace esim {

/// What the pixels of a tile saw between two samples, as far as it is needed to let some of them resume there.
struct PastSegment {
  Segment segment;
  Image<float> light0, light1;  // copies of the segment's irradiance where it is kept, of the tile's size
  // Filled in by PixelUpdate::advance(), of the tile's size where they are needed:
  Image<float> filtered1, filtered2;  // behind each pole at t0
  Image<float> start, end;            // brightness at t0 and t1 where a surround is subtracted
};

/// The segments in which a pixel may resume: those since the time until which the readout has worked. Private to the
/// event camera.
class SegmentHistory {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Adds segments, whose irradiance is borrowed until keep_after(). Those of a tile must follow each other, and tiles
  /// must not overlap.
  void add(std::span<const Segment> segments, const PixelArray& pixels);
  /// The i-th of the segments that were added last, for those who advance pixels through it to fill in their state.
  PastSegment& added(std::size_t i) { return segments_[added_ + i]; }
  bool empty() const { return count_ == 0; }

  /// Forgets the segments that end by `watermark`, and copies the irradiance of the others.
  void keep_after(TimeNs watermark);

  /// The segment in which the pixel is at time t, t0 < t <= t1; kNone where that is not known yet.
  std::uint32_t find(std::uint32_t pixel, TimeNs t);
  /// The segment of the same tile after this one, or kNone.
  std::uint32_t next(std::uint32_t i) const { return next_[i]; }
  const PastSegment& operator[](std::uint32_t i) const { return segments_[i]; }

 private:
  void index();

  int width_ = 0, height_ = 0;
  std::vector<PastSegment> segments_;
  std::size_t count_ = 0, added_ = 0;      // in use; of them, before the last add()
  bool indexed_ = false;                   // what follows is up to date
  std::vector<std::uint32_t> first_seen_;  // by pixel
  std::vector<std::uint32_t> next_;
};

}  // namespace esim
