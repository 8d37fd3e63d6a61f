// Keeps the past that reference.cpp has at hand in raise() and acknowledge(), because it runs frame by frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/state_archive.h"
#include "esim/event_camera/pixel/pixel_array.h"
#include "esim/render/sample.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// A segment of a tile with the data that pixels need to resume in it.
struct PastSegment {
  Segment segment;
  Image<float> light0, light1;  // copies of the segment's irradiance if it is kept, of the tile's size
  // Filled in by CircuitArray::advance(), of the tile's size: CircuitArray::front() at t0.
  std::vector<Image<double>> front;
  // Filled in by PixelUpdate::advance() if needed, of the tile's size:
  Image<float> filtered1, filtered2;  // after each pole at t0
  Image<float> start, end;            // brightness at t0 and t1 if a surround is subtracted
};

/// The segments in which a pixel may resume: those that end after the time that the readout has reached.
class SegmentHistory {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Adds segments, whose irradiance is borrowed until keep_after(). The segments of a tile must be consecutive, and
  /// tiles must not overlap.
  void add(std::span<const Segment> segments, const PixelArray& pixels);
  /// The same for pixels of a circuit, with so many values in PastSegment::front.
  void add(std::span<const Segment> segments, int width, int height, int front_values);
  /// The i-th of the segments in the last add(), to fill in the state of the pixels.
  PastSegment& added(std::size_t i) { return segments_[added_ + i]; }
  bool empty() const { return count_ == 0; }

  /// Removes the segments that end by `watermark`, and copies the irradiance of the others.
  void keep_after(TimeNs watermark);

  /// The segment of the pixel at time t, t0 < t <= t1; kNone if it is not known yet.
  std::uint32_t find(std::uint32_t pixel, TimeNs t);
  /// The segment of the same tile after this one, or kNone.
  std::uint32_t next(std::uint32_t i) const { return next_[i]; }
  const PastSegment& operator[](std::uint32_t i) const { return segments_[i]; }

  /// Its state after keep_after(), for core/state_archive.h.
  void save(StateWriter& archive) const;
  void restore(StateReader& archive);

 private:
  void append(std::span<const Segment> segments, bool filtered1, bool filtered2, bool ends);
  void index();

  int width_ = 0, height_ = 0;
  std::vector<PastSegment> segments_;
  std::size_t count_ = 0, added_ = 0;      // in use; in use before the last add()
  bool indexed_ = false;                   // the following members are up to date
  std::vector<std::uint32_t> first_seen_;  // per pixel
  std::vector<std::uint32_t> next_;
};

}  // namespace esim::inline event_camera
