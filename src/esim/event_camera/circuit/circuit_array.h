#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "esim/core/large_vector.h"
#include "esim/core/per_pixel.h"
#include "esim/core/random.h"
#include "esim/core/time.h"
#include "esim/event_camera/circuit/circuit_lanes.h"
#include "esim/event_camera/circuit/circuit_pixel.h"
#include "esim/event_camera/circuit/frame_coupling.h"
#include "esim/event_camera/options.h"
#include "esim/event_camera/segment_history.h"
#include "esim/events/packed_events.h"
#include "esim/render/sample.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// The working memory of a thread.
struct CircuitBuffer {
  static constexpr std::size_t kTogether = 256;
  template <typename T>
  using Values = std::array<T, kTogether + kVectorPadding>;

  Values<double> light, lag, y, v, w, light_sum;       // at the segment's end
  Values<double> level, rate, fast, slow, k1, passed;  // of CircuitPiece
  /// Columns whose pixels may fire, or need more than one step.
  struct Uncertain {
    std::vector<std::uint32_t> inactive, active, several;

    void clear() { inactive.clear(), active.clear(), several.clear(); }
  } uncertain;
  struct Found {
    std::uint32_t column;
    int polarity;
    double time;  // ns after the start of the segment
  };
  std::vector<Found> found;                   // events of uncertain pixels
  PerPixel<double> time, polarity, reported;  // of events
  PerPixel<std::uint32_t> place;
  std::size_t events = 0;
  std::int64_t lost = 0;         // events beyond the maximum rate of their pixels
  std::vector<NewLabel> labels;  // if they are wanted
  CircuitLanes lanes;
};

/// The pixels of a camera, by their circuit. In most segments, one vectorised solution of the front end and a
/// comparison with bounds suffice for inactive pixels. CircuitLanes takes active ones along, and CircuitPixel those in
/// which something happens.
class CircuitArray {
 public:
  CircuitArray(const EventCameraOptions& options, int width, int height, std::uint64_t seed, std::uint16_t stream);

  /// For a segment that is an instant: sets the references. Returns false, and changes nothing, if an irradiance is not
  /// a finite number >= 0.
  bool open(const Segment& segment, Rows rows);

  /// For any other segment: adds the events of rows of its pixels to `events`. Returns false likewise.
  bool advance(const Segment& segment, Rows rows, CircuitBuffer& buffer, PastSegment* past, PackedEvents& events);

  /// Ends the wait of a pixel whose request has been read at `t`. Returns the end of its refractory period.
  TimeNs acknowledge(std::uint32_t pixel, TimeNs t);

  /// Takes a pixel that is held in reset through a past segment; appends its next request, if there is one.
  void resume(std::uint32_t pixel, const PastSegment& past, CircuitBuffer& buffer, std::vector<Event>& requests);

  /// Number of values per pixel that a PastSegment keeps.
  int front_values() const { return 4 + (w_.empty() ? 0 : 1) + (light_sum_.empty() ? 0 : 1); }

  /// Whether each pixel is hot; only with labels.
  const std::vector<bool>& hot() const { return hot_; }

  /// Divides segments so that the coupling of frames is linear within each; valid until the next call.
  std::span<const Segment> divide(std::span<const Segment> segments) {
    return coupling_.active() ? divider_.divide(segments, coupling_, epoch_) : segments;
  }

  void set_epoch(TimeNs t) {
    if (epoch_ == kNoEpoch) epoch_ = t;
  }

  /// The variable state, for core/state_archive.h.
  template <class Archive, class Self>
  static void transfer(Archive& archive, Self& self) {
    archive.value(self.epoch_);
    archive.fixed(self.states_);
    for (auto* values : self.front()) archive.fixed(*values);
    for (auto* values : {&self.low_, &self.high_, &self.until_}) archive.fixed(*values);
    archive.fixed(self.node_light_);
    archive.fixed(self.origins_);
  }

 private:
  static constexpr TimeNs kNoEpoch = std::numeric_limits<TimeNs>::min();
  static constexpr double kGuard = 1e-9;  // between bounds and levels, above all rounding errors

  /// A row of a segment's tile, from the tile's first pixel on.
  struct Row {
    const float *light0, *light1;  // irradiance at both ends
    std::size_t first;             // pixel
    int y, x;
    std::size_t count;
    TimeNs t0;
    double start, length;  // ns after the epoch; ns
    Ramp coupled;          // of frames
    EventPacking packing;
  };

  /// What the front end of a pixel keeps from segment to segment; what is not in use is empty.
  std::array<LargeVector<double>*, 6> front() { return {&light_, &lag_, &y_, &v_, &w_, &light_sum_}; }
  std::array<const LargeVector<double>*, 6> front() const { return {&light_, &lag_, &y_, &v_, &w_, &light_sum_}; }
  void make_pixels(const EventCameraOptions& options, std::uint64_t seed, std::uint16_t stream);
  template <class D>
  void move_vector(D d, const Row& row, std::size_t x, CircuitBuffer& buffer, std::size_t at);
  void advance_uncertain(const Row& row, std::size_t begin, CircuitBuffer& buffer);
  void advance_in_one(const Row& row, std::span<const std::uint32_t> columns, std::size_t begin, CircuitBuffer& buffer);
  void advance_in_several(const Row& row, std::span<const std::uint32_t> columns, std::size_t begin,
                          CircuitBuffer& buffer);
  void finish(const Row& row, std::uint32_t column, std::size_t at, const CircuitPiece& piece, double done,
              std::size_t lane, CircuitState& front, CircuitBuffer& buffer);
  CircuitLanes::Lanes wake(CircuitLanes& lanes, const std::array<std::size_t, CircuitLanes::kLanes>& pixels,
                           CircuitLanes::Lanes inactive, CircuitLanes::Lanes& rests);
  bool is_quiet(const CircuitLanes& lanes, std::size_t lane, std::size_t i) const;
  LeakRamp leak_in(const Row& row, std::size_t column, std::size_t at, const CircuitBuffer& buffer) const;
  void set_bounds(std::size_t pixel, const CircuitBounds& bounds);
  CircuitPixel pixel(std::size_t i, KnownPath& known);
  LeakRamp leak(std::size_t i, double light_rate, double start) const;
  Ramp coupled_from(TimeNs t) const {
    return coupling_.active() ? coupling_.at(static_cast<double>(t - epoch_)) : Ramp();
  }
  void keep(std::size_t i, std::size_t at, const CircuitBuffer& buffer);
  void label(std::size_t i, TimeNs t, int polarity, std::vector<NewLabel>& labels) const;
  static void flush(const Row& row, CircuitBuffer& buffer, PackedEvents& events);

  Circuit circuit_;
  int width_, height_;
  AddressedRandom starts_;
  double dark_ = 0;      // L = ln(E + dark)
  bool limits_ = false;  // there is a maximum rate of events of a pixel
  TimeNs epoch_ = kNoEpoch;
  FrameCoupling coupling_;
  CornerDivider divider_;

  // Per pixel.
  LargeVector<CircuitParameters> parameters_;
  LargeVector<CircuitPixelState> states_;
  LargeVector<double> light_, lag_, y_, v_;  // at the last sample
  LargeVector<double> w_;                    // likewise, with a high-pass
  LargeVector<double> light_sum_;            // rounded irradiance times ns, summed; if light causes leak
  LargeVector<double> low_, high_, until_;   // CircuitBounds, with absolute levels
  LargeVector<float> node_light_, leak_;     // leak: without the part that light causes, 1/s
  LargeVector<float> light_leak_;            // the part that light causes, 1/s at irradiance 1
  LargeVector<CircuitOrigin> origins_;       // with labels
  std::vector<bool> hot_;                    // with labels
};

}  // namespace esim::inline event_camera
