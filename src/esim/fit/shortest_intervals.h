#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "esim/core/image.h"
#include "esim/core/time.h"
#include "esim/events/event.h"
#include "esim/fit/estimate.h"

namespace esim::inline fit {

/// The refractory period from events alone (docs/methods/fitting.md, section 3): no interval between two events of a
/// pixel is shorter. If their density begins with a step, as of random events or of edges that are much faster than the
/// refractory period, then the shortest of n intervals exceeds the period by an exponentially distributed time.
/// Otherwise, the shortest interval is only an upper limit.
class ShortestIntervals {
 public:
  ShortestIntervals(int width, int height) : last_(width, height, kNone) {}

  /// Events in order of time.
  void add(EventSpan events);
  /// Ends a recording: the next events are of another one.
  void end_recording() { last_.fill(kNone); }

  struct Result {
    Estimate refractory;               ///< refractory_period_us
    double shortest_us = 0;            ///< NaN without intervals
    std::vector<double> intervals_us;  ///< the shortest ones, in order
  };
  /// `stamp_unit`: the unit of the time stamps, which are rounded to it.
  Result finish(TimeNs stamp_unit) const;

 private:
  static constexpr TimeNs kNone = std::numeric_limits<TimeNs>::min();
  static constexpr std::size_t kKept = 256;

  Image<TimeNs> last_;
  std::vector<TimeNs> heap_;  // the shortest intervals, the longest of them first
};

}  // namespace esim::inline fit
