#pragma once

#include <cmath>
#include <deque>
#include <span>
#include <vector>

#include "esim/core/image.h"
#include "esim/event_camera/options.h"
#include "esim/render/sample.h"

// Private to event_camera.
namespace esim::inline event_camera {

/// A linear function of time: value + slope s, s in ns after a start.
struct Ramp {
  double value = 0, slope = 0;
};

/// What frames that the chip exposes beside the events add to the input of all comparators: -frame_coupling during each
/// exposure, which it reaches within 200 us and leaves within 10 us. Frame k is centred on frame_offset_ms + k /
/// frame_rate_hz after the epoch; without an offset as those of a frame camera. The first frame is the first whose
/// exposure begins after the epoch.
class FrameCoupling {
 public:
  static constexpr TimeNs kFall = 200 * kNsPerUs, kRise = 10 * kNsPerUs;

  explicit FrameCoupling(const CircuitOptions& options)
      : coupling_(options.frame_coupling),
        period_(1e6 * options.frame_period_ms()),
        offset_(1e6 * options.frame_offset_ms),
        exposure_(static_cast<TimeNs>(1e6 * options.exposure_ms())),
        first_(std::floor((0.5 * static_cast<double>(exposure_) - offset_) / period_) + 1) {}

  bool active() const { return coupling_ != 0; }

  /// The function from t (ns after the epoch) to the next corner.
  Ramp at(double t) const;

  /// The first corner after t, where the slope changes, in ns after the epoch.
  TimeNs next_corner(TimeNs t) const;

 private:
  /// The start of an exposure.
  TimeNs start(double frame) const { return static_cast<TimeNs>(offset_ + frame * period_) - exposure_ / 2; }

  double coupling_, period_, offset_;
  TimeNs exposure_;
  double first_;  // frame
};

/// Divides segments at the corners of the coupling, by interpolating the irradiance.
class CornerDivider {
 public:
  /// The divided segments; valid until the next call, as long as the irradiance of `segments`.
  std::span<const Segment> divide(std::span<const Segment> segments, const FrameCoupling& coupling, TimeNs epoch);

 private:
  std::vector<Segment> divided_;
  std::deque<Image<float>> images_;  // irradiance at the corners
};

}  // namespace esim::inline event_camera
